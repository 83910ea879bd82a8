"use strict";
// What every page of tuckerl can do with scripts: tables become files, and figures that can be explored take the place
// of the still ones. Without scripts all of this is missing, and nothing else.
const tuckerl = {
  kinds: {}, // by the name of a kind of figure: what draws it, (place, content, figure) => undefined

  /** Return an element; texts in it are texts, whatever is in them. */
  element(name, attributes = {}, ...children) {
    const svg = ["svg", "g", "path", "line", "text", "rect", "circle", "title", "polyline"].includes(name);
    const made = svg ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
      else if (value === true) made.setAttribute(key, "");
      else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value);
    }
    made.append(...children.filter((child) => child !== null && child !== undefined));
    return made;
  },

  /** Return rows of cells as CSV. */
  csv(rows) {
    const quoted = (cell) => (/[",\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell);
    return rows.map((row) => row.map((cell) => quoted(String(cell ?? ""))).join(",")).join("\n") + "\n";
  },

  /** Return a button that downloads what `text` gives when it is pressed. */
  download(label, name, text) {
    const press = () => {
      const address = URL.createObjectURL(new Blob([text()], { type: "text/csv" }));
      tuckerl.element("a", { href: address, download: name }).click();
      setTimeout(() => URL.revokeObjectURL(address), 10000);
    };
    return tuckerl.element("button", { type: "button", class: "quiet", onclick: press }, label);
  },

  /** Return a labelled choice among names, as radio buttons; `change` is called with the one chosen. */
  choice(label, names, chosen, change) {
    const group = `choice-${(tuckerl.choices = (tuckerl.choices ?? 0) + 1)}`;
    const one = (name) => {
      const input = tuckerl.element("input", { type: "radio", name: group, onchange: () => change(name) });
      input.checked = name === chosen;
      return tuckerl.element("label", {}, input, ` ${name}`);
    };
    return tuckerl.element("fieldset", {}, tuckerl.element("legend", {}, label), ...names.map(one));
  },

  /** Return a labelled slider over whole numbers, with the words that `say` has for one; `change` is called with it. */
  slider(label, most, value, say, change) {
    const output = tuckerl.element("output", {}, say(value));
    const input = tuckerl.element("input", { type: "range", min: 0, max: most, step: 1, value });
    const show = () => {
      output.textContent = say(+input.value);
      input.setAttribute("aria-valuetext", say(+input.value));
    };
    input.addEventListener("input", () => {
      show();
      change(+input.value);
    });
    show();
    const made = tuckerl.element("label", { class: "slider" }, `${label} `, input, output);
    made.set = (number) => {
      input.value = number;
      show();
    };
    return made;
  },
};

document.addEventListener("DOMContentLoaded", () => {
  const words = (cell) => {
    const copy = cell.cloneNode(true);
    for (const part of copy.querySelectorAll(".small")) part.prepend(" ");
    return copy.textContent.replace(/\s+/g, " ").trim();
  };
  for (const table of document.querySelectorAll("table.cards")) {
    const title = table.caption?.textContent.trim() ?? "table";
    const rows = () => [...table.rows].map((row) => [...row.cells].map(words));
    const name = `${title.toLowerCase().replace(/[^a-z0-9]+/g, "-").slice(0, 60).replace(/^-|-$/g, "")}.csv`;
    const button = tuckerl.download("Download as CSV", name, () => tuckerl.csv(rows()));
    button.setAttribute("aria-label", `Download as CSV: ${title}`);
    table.after(tuckerl.element("p", { class: "links small" }, button));
  }
  for (const figure of document.querySelectorAll("figure[data-kind]")) {
    const content = JSON.parse(document.getElementById(`data-${figure.id}`).textContent);
    const place = figure.querySelector(".live");
    figure.classList.add("is-live");
    tuckerl.kinds[figure.dataset.kind](place, content, figure);
  }
});
