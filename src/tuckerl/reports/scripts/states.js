"use strict";
// A table of values, to be explored: a board of the states where they have a layout, what one state holds, and a list
// of all states that can be searched and sorted. The arrays come as base64 of little-endian numbers.
(() => {
  const { element } = tuckerl;
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  tuckerl.floats = (text) => new Float32Array(bytes(text).buffer);
  tuckerl.wholes = (text) => new Int32Array(bytes(text).buffer);

  /** Return a number with about four figures, as text.py words what is measured; a dash where there is none. */
  tuckerl.number = (value) => {
    if (Number.isNaN(value)) return "–";
    const size = Math.abs(value);
    if (value === 0) return "0";
    if (size === Infinity) return value > 0 ? "∞" : "−∞";
    const digits = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 1 ? 2 : 4;
    const fixed = { minimumFractionDigits: digits, maximumFractionDigits: digits };
    const words = size >= 0.01 && size < 1e9 ? value.toLocaleString("en", fixed) : value.toExponential(2);
    return words.replaceAll("-", "−");
  };

  /** Return the colour at `part`, from 0 to 1, of the way along some colours: [red, green, blue]. */
  tuckerl.colour = (colours, part) => {
    const place = Math.min(Math.max(part, 0), 1) * (colours.length - 1);
    const [from, to] = [colours[Math.floor(place)], colours[Math.ceil(place)]];
    return from.map((level, i) => level + (to[i] - level) * (place % 1));
  };

  /** Return a board of cells: `paint` colours them by their numbers, and what is drawn in `above` lies on them. */
  tuckerl.board = ([rows, columns], walls, colours, widest = Math.max(30, 320 / columns)) => {
    const canvas = element("canvas", { width: columns, height: rows });
    const above = element("svg", { viewBox: `0 0 ${columns} ${rows}`, preserveAspectRatio: "none" });
    const node = element("div", { class: "board", "aria-hidden": "true" }, canvas, above);
    // A corridor's cells are oblong, for it to be seen.
    node.style.aspectRatio = Math.min(Math.max(columns / rows, 0.2), 16);
    node.style.width = `min(100%, ${Math.max(columns * Math.min(widest, 640 / rows), 40)}px)`;
    const paint = (values, low, high) => {
      const image = new ImageData(columns, rows);
      for (let cell = 0; cell < rows * columns; cell++) {
        const none = Number.isNaN(values[cell]) ? [255, 255, 255] : null;
        const part = high > low ? (values[cell] - low) / (high - low) : 0.5;
        const [red, green, blue] = walls?.[cell] ? [31, 31, 31] : (none ?? tuckerl.colour(colours, part));
        image.data.set([red, green, blue, 255], 4 * cell);
      }
      canvas.getContext("2d").putImageData(image, 0, 0);
    };
    return { node, above, paint };
  };

  /** Return a labelled choice from a list; `change` is called with the number of the one chosen. */
  const select = (label, names, change) => {
    const options = names.map((name, place) => element("option", { value: place }, name));
    const made = element("select", { onchange: () => change(+made.value) }, ...options);
    return element("label", {}, `${label} `, made);
  };

  /** Return the content with its arrays read, and what is asked of them by state: `of(state)` is a state's row. */
  const read = (content) => {
    const { n_states, actions, layout } = content;
    const listed = tuckerl.wholes(content.states);
    const row = new Int32Array(n_states).fill(-1);
    listed.forEach((state, place) => (row[state] = place));
    const q = content.q.map(tuckerl.floats);
    const best = content.best.map(tuckerl.wholes);
    const allowed = content.allowed?.map(bytes);
    const walls = content.walls && bytes(content.walls);
    const optimal = content.optimal && tuckerl.floats(content.optimal);
    const factors = layout && content.factors.length === 1 ? [["row", layout[0]], ["column", layout[1]]] : content.factors;
    const at = (agent, state, action) => {
      const place = row[state] * actions.length + action;
      return row[state] < 0 || (allowed && !allowed[agent][place]) ? NaN : q[agent][place];
    };
    const greedy = (agent, state) => (row[state] < 0 ? -1 : best[agent][row[state]]);
    const value = (agent, state) => (greedy(agent, state) < 0 ? NaN : at(agent, state, greedy(agent, state)));
    const digits = (state) => {
      const found = [];
      for (const [, size] of [...factors].reverse()) {
        found.unshift(state % size);
        state = Math.floor(state / size);
      }
      return found;
    };
    const named = (state) => digits(state).map((digit, i) => `${factors[i][0]} ${digit}`).join(", ");
    const words = (state) => (factors.length > 1 ? `${named(state)} (state ${state})` : `state ${state}`);
    const is_allowed = (agent, state, action) => !allowed || allowed[agent][row[state] * actions.length + action] > 0;
    return { ...content, listed, row, walls, optimal, factors, at, greedy, value, digits, words, is_allowed, n_agents: q.length };
  };

  /** Return what the cells can be coloured by: a name, and a number of each state for an agent. */
  const layers = (table) => {
    const { n_agents, optimal } = table;
    const values = (state) => Array.from({ length: n_agents }, (_, agent) => table.value(agent, state)).filter((v) => !Number.isNaN(v));
    const spread = (state) => (values(state).length > 1 ? Math.max(...values(state)) - Math.min(...values(state)) : NaN);
    const others = (agent, state) => {
      const mine = table.greedy(agent, state);
      const theirs = Array.from({ length: n_agents }, (_, other) => table.greedy(other, state));
      return mine < 0 ? NaN : theirs.filter((action) => action >= 0 && action !== mine).length;
    };
    return [
      { name: "state value, max Q(s, a)", of: table.value },
      optimal && { name: "optimal value, V*(s)", of: (_, state) => optimal[state] },
      optimal && { name: "optimal less learned value", of: (agent, state) => optimal[state] - table.value(agent, state) },
      n_agents > 1 && { name: "agents with another greedy action", of: others },
      n_agents > 1 && { name: "spread of the agents' values", of: (_, state) => spread(state) },
      ...table.actions.map((action, i) => ({ name: `Q(s, ${action})`, of: (agent, state) => table.at(agent, state, i) })),
    ].filter(Boolean);
  };

  /** Return the numbers of all states but walls for an agent, and the least and the largest of all agents. */
  const numbers_of = (table, layer, agent) => {
    const of = (one) => Float32Array.from({ length: table.n_states }, (_, s) => (table.walls?.[s] ? NaN : layer.of(one, s)));
    layer.range ??= (() => {
      let [low, high] = [Infinity, -Infinity];
      for (let one = 0; one < table.n_agents; one++)
        for (const value of of(one)) if (Number.isFinite(value)) [low, high] = [Math.min(low, value), Math.max(high, value)];
      return low > high ? [0, 0] : [low, high];
    })();
    return [of(agent), ...layer.range];
  };

  const OUTLINE = [[-1, 0.1], [0.1, 0.1], [0.1, 0.52], [1, 0], [0.1, -0.52], [0.1, -0.1], [-1, -0.1]];

  /** Return the arrows of an agent's greedy actions as two paths: on light cells and on dark ones. */
  const arrows = (table, agent, [values, low, high], every) => {
    const [rows, columns] = table.layout;
    const paths = ["", ""];
    for (let row = every >> 1; row < rows; row += every)
      for (let column = every >> 1; column < columns; column += every) {
        const state = row * columns + column;
        const action = table.greedy(agent, state);
        if (action < 0 || table.walls?.[state]) continue;
        const shade = tuckerl.colour(table.colours, high > low ? (values[state] - low) / (high - low) : 0.5);
        const dark = !Number.isNaN(values[state]) && 0.299 * shade[0] + 0.587 * shade[1] + 0.114 * shade[2] < 115;
        const [x, y, half] = [column + 0.5, row + 0.5, 0.36 * every];
        const way = table.ways[action];
        if (!way) paths[+dark] += `M${x - half / 3} ${y}a${half / 3} ${half / 3} 0 1 0 ${(2 * half) / 3} 0a${half / 3} ${half / 3} 0 1 0 ${(-2 * half) / 3} 0z`;
        else {
          const long = half / Math.hypot(...way);
          const corner = ([along, aside]) => `${x + long * (along * way[1] - aside * way[0])} ${y + long * (along * way[0] + aside * way[1])}`;
          paths[+dark] += `M${OUTLINE.map(corner).join("L")}z`;
        }
      }
    return paths.map((d, dark) => element("path", { d, fill: dark ? "#fff" : "#000" }));
  };

  /** Return the line of a path through the cells: white around black, to be seen on every colour. */
  const trail = (states, columns) => {
    const points = Array.from(states, (state) => `${(state % columns) + 0.5},${Math.floor(state / columns) + 0.5}`).join(" ");
    const line = (colour, width) => element("polyline", { points, fill: "none", stroke: colour, "stroke-width": width, "vector-effect": "non-scaling-stroke", "stroke-linejoin": "round" });
    return [line("#fff", 5), line("#000", 2.5)];
  };

  const board_of = (table, view, choose) => {
    const [rows, columns] = table.layout;
    const all = layers(table);
    const board = tuckerl.board(table.layout, table.walls, table.colours);
    const cursor = ["#fff", "#000"].map((colour, i) => element("rect", { width: 1, height: 1, fill: "none", stroke: colour, "stroke-width": 5 - 3 * i, "vector-effect": "non-scaling-stroke" }));
    const marks = element("g");
    const [low, high] = [element("span"), element("span")];
    const hint = "Point at a cell, or press the arrow keys, to read its values.";
    const outside = element("div", { tabindex: 0, role: "application", "aria-label": `Board of ${rows} rows and ${columns} columns. ${hint}` }, board.node);
    board.above.append(marks, ...cursor);
    const show = () => {
      const numbers = numbers_of(table, all[view.layer], view.agent);
      board.paint(...numbers);
      [low.textContent, high.textContent] = numbers.slice(1).map(tuckerl.number);
      const every = Math.max(1, Math.ceil(7 / ((board.node.clientWidth || 600) / columns)));
      const states = view.path < 0 ? [] : table.paths[view.path].states[view.agent];
      marks.replaceChildren(...(states.length ? trail(states, columns) : []), ...(view.arrows ? arrows(table, view.agent, numbers, every) : []));
    };
    const mark = () => {
      for (const rect of cursor) for (const [name, place] of [["x", view.state % columns], ["y", Math.floor(view.state / columns)]]) rect.setAttribute(name, place);
    };
    const point = (event) => {
      const box = board.node.getBoundingClientRect();
      const [column, row] = [((event.clientX - box.x) / box.width) * columns, ((event.clientY - box.y) / box.height) * rows].map(Math.floor);
      if (row >= 0 && row < rows && column >= 0 && column < columns) choose(row * columns + column);
    };
    const keys = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1], Home: [0, -columns], End: [0, columns] };
    board.node.addEventListener("pointermove", point);
    board.node.addEventListener("pointerdown", point);
    outside.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      const within = (place, size) => Math.min(Math.max(place, 0), size - 1);
      const [down, right] = keys[event.key];
      choose(within(Math.floor(view.state / columns) + down, rows) * columns + within((view.state % columns) + right, columns));
    });
    const gradient = table.colours.map((colour) => `rgb(${colour})`).join(",");
    const bar = element("span", { class: "gradient" });
    bar.style.background = `linear-gradient(to right, ${gradient})`;
    const paths = ["none", ...table.paths.map((path) => path.name)];
    const tick = element("input", { type: "checkbox", checked: true, onchange: () => { view.arrows = tick.checked; show(); } });
    const controls = element("div", { class: "controls" },
      select("Colour", all.map((layer) => layer.name), (layer) => { view.layer = layer; show(); }),
      table.paths.length ? select("Path", paths, (path) => { view.path = path - 1; show(); }) : null,
      element("label", {}, tick, " greedy actions"));
    if (table.paths.length) controls.querySelectorAll("select")[1].value = 1;
    const legend = element("p", { class: "small legend" }, low, bar, high, element("span", {}, `${table.walls ? "black: blocked; " : ""}white: nothing preferred or not listed`));
    new ResizeObserver(show).observe(board.node);
    return { controls, nodes: [outside, legend, element("p", { class: "small" }, hint)], show, mark };
  };

  /** Return what a state holds for an agent: its values as bars, the greedy action, the optimal value, other agents. */
  const state_words = (table, view) => {
    const { state, agent } = view;
    const head = element("p", {}, element("strong", {}, table.words(state)));
    if (table.walls?.[state]) return [head, element("p", {}, "Blocked: nobody can stand here.")];
    if (table.row[state] < 0) return [head, element("p", {}, "Not listed: see below the list of states.")];
    const values = table.actions.map((_, action) => table.at(agent, state, action));
    const finite = values.filter(Number.isFinite);
    const [low, high] = [Math.min(...finite), Math.max(...finite)];
    const greedy = table.greedy(agent, state);
    const rows = table.actions.map((action, i) => {
      const bar = element("span", { class: "bar" });
      bar.style.width = `${Number.isFinite(values[i]) && high > low ? 4 + (96 * (values[i] - low)) / (high - low) : 4}%`;
      const number = table.is_allowed(agent, state, i) ? tuckerl.number(values[i]) : "not allowed";
      return element("tr", i === greedy ? { class: "greedy" } : {}, element("th", { scope: "row" }, i === greedy ? `${action} (greedy)` : action),
        element("td", { class: "bars", "aria-hidden": "true" }, bar), element("td", { class: "number" }, number));
    });
    const others = Array.from({ length: Math.min(table.n_agents, 20) }, (_, other) => `agent ${other} ${table.actions[table.greedy(other, state)] ?? "none"}`);
    return [
      head,
      element("table", {}, element("caption", {}, table.n_agents > 1 ? `Q(s, a) of agent ${agent}` : "Q(s, a)"), element("tbody", {}, ...rows)),
      greedy < 0 ? element("p", {}, "No action is better than another.") : null,
      table.optimal ? element("p", {}, `Optimal value: ${tuckerl.number(table.optimal[state])}`) : null,
      table.n_agents > 1 ? element("p", {}, `Greedy: ${others.join(", ")}`) : null,
    ];
  };

  /** Return the columns of the list: a head, whether it is a number, and its cell of a state. */
  const columns_of = (table, view) => [
    { head: "state", of: (state) => state, words: String },
    ...(table.factors.length > 1 ? table.factors.map(([head], i) => ({ head, of: (state) => table.digits(state)[i], words: String })) : []),
    { head: "greedy action", of: (state) => table.actions[table.greedy(view.agent, state)] ?? "", words: String, text: true },
    { head: "value", of: (state) => table.value(view.agent, state), words: tuckerl.number },
    ...(table.optimal ? [{ head: "optimal", of: (state) => table.optimal[state], words: tuckerl.number }] : []),
    ...table.actions.map((action, i) => ({ head: `Q(s, ${action})`, of: (state) => table.at(view.agent, state, i), words: tuckerl.number })),
  ];

  /** Return whether each word of a query is the state's number, a factor's value ("row=3") or in its action's name. */
  const matches = (table, view, query) => {
    const asked = query.toLowerCase().split(/[\s,]+/).filter(Boolean);
    return (state) => asked.every((word) => {
      const [name, wanted] = word.split("=");
      if (wanted !== undefined) return ["state", ...table.factors.map(([factor]) => factor.toLowerCase())].some((factor, i) => factor.startsWith(name) && String(i ? table.digits(state)[i - 1] : state) === wanted);
      return /^\d+$/.test(word) ? String(state) === word : (table.actions[table.greedy(view.agent, state)] ?? "none").toLowerCase().includes(word);
    });
  };

  const PAGE = 15;
  const list_of = (table, view, choose) => {
    const columns = columns_of(table, view);
    let [query, from, by, sign] = ["", 0, 0, 1];
    const body = element("tbody");
    const said = element("output");
    const move = (steps) => { from += steps * PAGE; show(); };
    const [back, on] = [["Previous", -1], ["Next", 1]].map(([words, steps]) => element("button", { type: "button", onclick: () => move(steps) }, words));
    const heads = columns.map((column, i) => element("th", { scope: "col", class: column.text ? null : "number" }, element("button", { type: "button", class: "quiet", onclick: () => { [sign, by, from] = [by === i ? -sign : column.words === String ? 1 : -1, i, 0]; show(); } }, column.head)));
    const search = element("input", { type: "search", oninput: () => { [query, from] = [search.value, 0]; show(); } });
    const sorted = (states) => {
      const key = new Map(states.map((state) => [state, columns[by].of(state)]));
      const least = (value) => value === "" || Number.isNaN(value);
      return states.sort((a, b) => {
        const [x, y] = [key.get(a), key.get(b)];
        return least(x) || least(y) ? least(x) - least(y) || a - b : (x < y ? -sign : x > y ? sign : a - b);
      });
    };
    const found = () => sorted(Array.from(table.listed).filter(matches(table, view, query)));
    const cell = (state) => (column, i) => i === 0
      ? element("th", { scope: "row", class: "number" }, element("button", { type: "button", class: "quiet", onclick: () => choose(state), onfocus: () => choose(state) }, column.words(state)))
      : element("td", { class: column.text ? null : "number" }, column.words(column.of(state)));
    const show = () => {
      const states = found();
      from = Math.min(Math.max(from, 0), Math.max(0, Math.ceil(states.length / PAGE) - 1) * PAGE);
      const rows = states.slice(from, from + PAGE);
      body.replaceChildren(...rows.map((state) => element("tr", { onpointerenter: () => choose(state) }, ...columns.map(cell(state)))));
      said.textContent = states.length ? `${(from + 1).toLocaleString("en")} to ${(from + rows.length).toLocaleString("en")} of ${states.length.toLocaleString("en")} states` : "no state fits";
      [back.disabled, on.disabled] = [from === 0, from + PAGE >= states.length];
      heads.forEach((head, i) => (i === by ? head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending") : head.removeAttribute("aria-sort")));
    };
    const all = () => tuckerl.csv([columns.map((column) => column.head), ...found().map((state) => columns.map((column) => column.of(state)))]);
    const example = table.factors.length > 1 ? `, or ${table.factors[0][0].split(" ")[0]}=0` : "";
    const nodes = [
      element("div", { class: "controls" }, element("label", {}, "Search states ", search), element("span", { class: "small" }, `a state's number, a greedy action${example}`)),
      element("div", { class: "scroll", tabindex: 0, role: "group", "aria-label": "States" }, element("table", { class: "states" }, element("thead", {}, element("tr", {}, ...heads)), body)),
      element("div", { class: "controls" }, back, on, said, tuckerl.download("Download these states as CSV", "states.csv", all)),
      table.note ? element("p", { class: "small" }, table.note) : null,
    ];
    return { nodes, show };
  };

  tuckerl.kinds.states = (place, content) => {
    const table = read(content);
    const first = table.paths[0]?.states[0][0] ?? table.listed.find((state) => table.greedy(0, state) >= 0) ?? 0;
    const view = { agent: 0, layer: 0, path: table.paths.length ? 0 : -1, arrows: true, state: first };
    const readout = element("div", { class: "readout", "aria-live": "polite" });
    const choose = (state, again) => {
      if (state === view.state && !again) return;
      view.state = state;
      readout.replaceChildren(...state_words(table, view).filter(Boolean));
      board?.mark();
    };
    const board = table.layout && board_of(table, view, choose);
    const list = list_of(table, view, choose);
    const agents = Array.from({ length: table.n_agents }, (_, agent) => `agent ${agent}`);
    const change = (agent) => {
      view.agent = agent;
      board?.show();
      list.show();
      choose(view.state, true);
    };
    const controls = board?.controls ?? element("div", { class: "controls" });
    if (agents.length > 1) controls.prepend(select("Agent", agents, change));
    place.append(controls, element("div", { class: "beside" }, ...(board ? [element("div", { class: "cells" }, ...board.nodes)] : []), readout), ...list.nodes.filter(Boolean));
    change(0);
  };
})();
