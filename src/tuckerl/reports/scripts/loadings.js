"use strict";
// The state factor's columns as small boards, or as strips where states have no layout, and a slider through the
// episodes of the window: each column as strong as it is in that episode.
tuckerl.kinds.loadings = (place, content) => {
  const { element, number } = tuckerl;
  const walls = content.walls && Uint8Array.from(atob(content.walls), (letter) => letter.charCodeAt(0));
  const [rows, columns] = content.layout ?? [1, content.n_states];
  const strength = tuckerl.floats(content.strength); // (episodes, columns), 1 where a column is strongest
  const boards = content.columns.map((column, place_of) => {
    const board = tuckerl.board([rows, columns], walls, content.colours, content.layout ? Math.min(48, 190 / columns) : 600 / columns);
    if (!content.layout) Object.assign(board.node.style, { aspectRatio: "auto", height: "1.4rem", width: "100%" });
    const words = element("span", { class: "small" });
    const loadings = tuckerl.floats(column.loadings);
    const show = (episode) => {
      const part = episode < 0 ? 1 : strength[episode * content.columns.length + place_of];
      board.paint(loadings.map((value) => value * part), -column.largest, column.largest);
      words.textContent = episode < 0 ? `largest ${number(column.largest)}` : `strength ${Math.round(100 * part)} % of its largest`;
    };
    const title = element("span", {}, `${place_of + 1}: ${column.energy} of the energy `);
    return { show, node: element("div", { class: "loading" }, title, words, board.node) };
  });
  const most = content.last - content.first + 1;
  const say = (value) => (value === 0 ? "all, at full strength" : `episode ${content.first + value - 1}`);
  const slider = tuckerl.slider("Episode of the window", most, 0, say, (value) => boards.forEach((board) => board.show(value - 1)));
  const bar = element("span", { class: "gradient" });
  bar.style.background = `linear-gradient(to right, ${content.colours.map((colour) => `rgb(${colour})`).join(",")})`;
  const legend = element("p", { class: "small legend" }, "−largest", bar, "largest", element("span", {}, `${walls ? "black: blocked; " : ""}white: did not change`));
  const box = element("div", { class: content.layout ? "loadings" : "loadings strips" }, ...boards.map((board) => board.node));
  place.append(slider, legend, box);
  boards.forEach((board) => board.show(-1));
};
