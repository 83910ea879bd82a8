"use strict";
// The paths of all episodes through one maze: a slider through the episodes, and which variants are drawn.
(() => {
  const { element, plot } = tuckerl;
  const CELL = 10; // of the drawing's own unit

  tuckerl.kinds.paths = (place, content) => {
    const { rows, columns, paths, looks } = content;
    const n_episodes = Math.max(...paths.map((path) => path.episodes.length));
    const shown = new Set(paths.map((path) => path.name));
    let episode = n_episodes; // the one after the last: the shortest of all
    const at = (state) => [(state % columns) * CELL + CELL / 2, Math.floor(state / columns) * CELL + CELL / 2];
    const size = { viewBox: `-1 -1 ${columns * CELL + 2} ${rows * CELL + 2}`, class: "maze" };
    const svg = element("svg", { ...size, role: "img", "aria-label": `${content.title}: the lengths are in the table below` });
    svg.append(element("rect", { width: columns * CELL, height: rows * CELL, class: "floor" }));
    for (const wall of content.walls) {
      const [x, y] = at(wall);
      svg.append(element("rect", { x: x - CELL / 2, y: y - CELL / 2, width: CELL, height: CELL, class: "wall" }));
    }
    const lines = element("g");
    svg.append(lines);
    const corner = (cell) => at(cell[0] * columns + cell[1]);
    const [sx, sy] = corner(content.start);
    const [gx, gy] = corner(content.goal);
    svg.append(element("rect", { x: sx - 3, y: sy - 3, width: 6, height: 6, class: "end" }));
    svg.append(element("path", { d: `M${gx},${gy - 4.5}l4.5,4.5l-4.5,4.5l-4.5,-4.5Z`, class: "end" }));
    const table = element("div", { class: "scroll legend", tabindex: 0, role: "group", "aria-label": "Paths and their lengths" });
    const statesOf = (path) => (episode === n_episodes ? path.best : (path.episodes[episode] ?? []));

    function draw() {
      lines.replaceChildren();
      paths.forEach((path, i) => {
        if (!shown.has(path.name)) return;
        const apart = (i - (paths.length - 1) / 2) * 1.8; // so that one does not cover another
        const points = statesOf(path).map((state) => at(state).map((value) => value + apart).join(","));
        const look = looks[path.name];
        lines.append(element("polyline", { points: points.join(" "), style: `stroke:var(--${look.colour})`, class: "way" }));
      });
      const row = (path) => {
        const press = () => {
          shown[shown.has(path.name) ? "delete" : "add"](path.name);
          draw();
        };
        const button = { type: "button", class: "key", "aria-pressed": String(shown.has(path.name)), "data-name": path.name, onclick: press };
        const steps = statesOf(path).length - 1;
        const words = episode === n_episodes ? path.words : steps < 0 ? "no such episode" : `${plot.say(steps, true)} steps`;
        return element(
          "tr",
          {},
          element("th", { scope: "row" }, element("button", button, plot.swatch(looks[path.name]), ` ${path.name}`)),
          element("td", {}, words),
        );
      };
      const focused = table.contains(document.activeElement) ? document.activeElement.dataset.name : null;
      const head = element("tr", {}, element("th", { scope: "col" }, "Variant"), element("th", { scope: "col" }, "Length of the path"));
      table.replaceChildren(element("table", {}, element("thead", {}, head), element("tbody", {}, ...paths.map(row))));
      if (focused) [...table.querySelectorAll("button")].find((one) => one.dataset.name === focused)?.focus();
    }

    const say = (value) => (value === n_episodes ? "the shortest of all" : `${value + 1} of ${n_episodes}`);
    const key = element("p", { class: "small" }, `Square: start. Diamond: goal. The shortest possible path has ${content.shortest} steps.`);
    const slider = tuckerl.slider("Episode", n_episodes, episode, say, (value) => {
      episode = value;
      draw();
    });
    place.append(svg);
    if (n_episodes > 0) place.append(slider);
    else key.append(" These results are of an older version, which kept the shortest episodes only.");
    place.append(table, key);
    draw();
  };
})();
