"use strict";
// What the tensor step did after one window: a slider through the windows, a line in every figure by window at the one
// that is read, and its weights in numbers.
tuckerl.kinds.windows = (place, content, figure) => {
  const { element, number } = tuckerl;
  const [weights, fit, ranks] = [tuckerl.floats(content.weights), tuckerl.floats(content.fit), tuckerl.wholes(content.ranks)];
  const { episode, chosen, actions, modes } = content;
  const last = episode.at(-1);
  const ends = [...weights].filter(Number.isFinite);
  const high = ends.reduce((most, weight) => Math.max(most, weight), 0) || 1;

  // The first patch of a figure's axes is what they cover: their left end is 0 episodes, their right one all of them.
  const cursors = content.figures.flatMap((name) => {
    const drawn = document.querySelector(`#${name} .still svg`);
    return [...(drawn?.querySelectorAll('g[id*="-axes_"]') ?? [])].slice(0, name === "fit" ? 2 : 1).map((axes) => {
      const box = axes.querySelector("g path").getBBox();
      const line = element("line", { class: "cursor", y1: box.y, y2: box.y + box.height });
      axes.append(line);
      drawn.addEventListener("pointermove", (event) => {
        const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(drawn.getScreenCTM().inverse());
        const part = (point.x - box.x) / box.width;
        const inside = part >= 0 && part <= 1 && point.y >= box.y && point.y <= box.y + box.height;
        if (inside) choose(Math.max(0, episode.findIndex((end) => end >= part * last)));
      });
      return (at) => ["x1", "x2"].forEach((end) => line.setAttribute(end, box.x + (box.width * episode[at]) / last));
    });
  });

  const facts = element("p");
  const cells = actions.map(() => ({ bar: element("span", { class: "bar" }), words: element("td", { class: "number" }) }));
  const rows = actions.map((action, i) => element("tr", {}, element("th", { scope: "row" }, action), element("td", { class: "bars", "aria-hidden": "true" }, cells[i].bar), cells[i].words));
  const say = (at) => `after episode ${episode[at].toLocaleString("en")}`;
  const read = (at) => {
    const copied = chosen[at] < 0 ? "no single table was copied" : `all agents went on with agent ${chosen[at]}'s table`;
    const used = modes.map((mode, i) => `${mode} ${ranks[4 * at + i]}`).join(", ");
    const decomposed = Number.isFinite(fit[at]) ? `fit ${number(fit[at])}; ranks: ${used}` : ranks[4 * at] < 0 ? "no decomposition could be found" : "no decomposition";
    facts.textContent = `After episode ${episode[at].toLocaleString("en")}: ${content.agents > 1 ? `${copied}; ` : ""}${decomposed}.`;
    cells.forEach(({ bar, words }, i) => {
      const weight = weights[actions.length * at + i];
      bar.style.width = `${(100 * weight) / high}%`;
      words.textContent = number(weight);
    });
    cursors.forEach((move) => move(at));
  };
  const slider = tuckerl.slider("Window", episode.length - 1, episode.length - 1, say, read);
  const choose = (at) => {
    slider.set(at);
    read(at);
  };
  const table = element("table", {}, element("caption", {}, "Action weights ω in force from then on"), element("tbody", {}, ...rows));
  place.append(slider, element("div", { class: "readout", "aria-live": "polite" }, facts, table));
  read(episode.length - 1);
};
