"use strict";
// Renews the page when the server has a newer one, and keeps its reader's place: what is scrolled to, opened and chosen.
(() => {
  const version = document.currentScript.dataset.version;
  const KEY = "tuckerl-place";
  const EVERY = 2000; // milliseconds between two questions
  const inputs = () => [...document.querySelectorAll("input, select, textarea")];
  const folds = () => [...document.querySelectorAll("details")];

  const keep = () => {
    const chosen = inputs().map((one) => (["radio", "checkbox"].includes(one.type) ? one.checked : one.value));
    const focused = inputs().indexOf(document.activeElement);
    const place = { x: scrollX, y: scrollY, open: folds().map((one) => one.open), chosen, focused };
    sessionStorage.setItem(KEY, JSON.stringify(place));
  };

  const restore = () => {
    const kept = sessionStorage.getItem(KEY);
    if (!kept) return;
    sessionStorage.removeItem(KEY);
    const place = JSON.parse(kept);
    folds().forEach((one, at) => (one.open = place.open[at] ?? one.open));
    inputs().forEach((one, at) => {
      const kind = ["radio", "checkbox"].includes(one.type) ? "checked" : "value";
      if (place.chosen[at] === undefined || place.chosen[at] === one[kind]) return;
      one[kind] = place.chosen[at];
      for (const event of ["input", "change"]) one.dispatchEvent(new Event(event, { bubbles: true }));
    });
    inputs()[place.focused]?.focus({ preventScroll: true });
    requestAnimationFrame(() => scrollTo({ left: place.x, top: place.y, behavior: "instant" }));
  };

  const ask = async () => {
    try {
      const answer = await fetch("/version", { cache: "no-store" });
      const newest = await answer.text();
      if (answer.ok && newest !== version) {
        keep();
        location.reload();
        return;
      }
    } catch {
      // The server has ended: the page stays as it is.
    }
    setTimeout(ask, EVERY);
  };

  history.scrollRestoration = "manual";
  addEventListener("load", () => {
    restore();
    ask();
  });
})();
