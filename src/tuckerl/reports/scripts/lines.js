"use strict";
// Curves to be explored: means with intervals, single runs, one run; what differences are taken from; both axes linear
// or logarithmic. The table below the curves is their legend, and says the numbers at one place of the axis.
(() => {
  const { element, plot } = tuckerl;
  const MOST_DRAWN = 60; // single runs of a line: more are a wall of ink, and slow
  const MOST_LISTED = 10;
  const MEANS = "means";
  const RUNS = "means and single runs";
  const ONE = "one run";

  /** Return a series of runs: rounded in the page to 16 bits between its least and its largest number. */
  function decoded(runs, n_points) {
    const bytes = Uint8Array.from(atob(runs.codes), (letter) => letter.charCodeAt(0));
    const codes = new Uint16Array(bytes.buffer);
    return runs.numbers.map((_, run) =>
      Array.from(codes.subarray(run * n_points, (run + 1) * n_points), (code) => runs.low + code * runs.step),
    );
  }

  class Lines {
    constructor(place, content, figure) {
      Object.assign(this, { place, content, figure });
      this.choice = content.choose?.names[0] ?? "";
      this.mode = MEANS;
      this.hidden = new Set();
      this.strong = null;
      this.xLog = this.yLog = false;
      this.runs = content.runs ?? null;
      if (this.runs) {
        this.numbers = [...new Set(this.runs.variants.flatMap((own) => own.numbers))].sort((a, b) => a - b);
        this.run = this.numbers[0];
        this.series = new Map(this.runs.variants.map((own) => [own.name, own]));
      }
      this.svg = element("svg", { role: "img", "aria-label": `${content.title}: the numbers are in the table below` });
      this.tip = element("div", { class: "tip", hidden: true });
      this.stage = element("div", { class: "stage" }, this.svg, this.tip);
      this.legend = element("div", { class: "scroll legend", tabindex: 0, role: "group", "aria-label": "Lines and numbers" });
      this.note = element("p", { class: "small" });
      place.append(this.controls(), this.stage, this.episodeSlider(), this.legend, this.note);
      if (this.runs) place.append(this.finder());
      this.stage.addEventListener("pointermove", (event) => this.point(event));
      this.stage.addEventListener("pointerleave", () => this.unpoint());
      new ResizeObserver(() => this.stage.clientWidth !== this.width && this.draw()).observe(this.stage);
      this.draw();
    }

    get x() {
      return this.content.x[this.choice] ?? this.content.x[""];
    }

    controls() {
      const { choose, logs } = this.content;
      const change = (name) => (value) => {
        this[name] = value;
        this.draw();
      };
      const parts = [];
      if (choose && choose.names.length > 1)
        parts.push(tuckerl.choice(choose.label, choose.names, this.choice, change("choice")));
      if (this.runs) parts.push((this.modes = tuckerl.choice("Show", [MEANS, RUNS, ONE], this.mode, change("mode"))));
      const box = (label, name) => {
        const input = element("input", { type: "checkbox", onchange: () => change(name)(input.checked) });
        return element("label", {}, input, ` ${label}`);
      };
      if (logs) parts.push(element("fieldset", {}, element("legend", {}, "Logarithmic"), box(this.content.xLabel, "xLog"), box(logs, "yLog")));
      this.range = [1, 2].map((end) => {
        const input = element("input", { type: "number", min: 0, "aria-label": `${end === 1 ? "First" : "Last"} of the ${this.content.xLabel} shown` });
        input.addEventListener("change", () => this.draw());
        return input;
      });
      const whole = () => {
        for (const input of this.range) input.value = "";
        this.draw();
      };
      const reset = element("button", { type: "button", class: "quiet", onclick: whole }, "all");
      parts.push(element("span", { class: "range" }, element("b", {}, "From "), this.range[0], element("b", {}, " to "), this.range[1], " ", reset));
      return element("div", { class: "controls" }, ...parts);
    }

    episodeSlider() {
      const say = (at) => `${plot.say(this.x[Math.min(at, this.x.length - 1)], true)}`;
      this.at = this.x.length - 1;
      this.slider = tuckerl.slider(`Numbers at ${this.content.xOne}`, this.at, this.at, say, (at) => {
        this.at = at;
        this.mark();
        this.tell();
      });
      return this.slider;
    }

    /** Return the panels that have any lines with what is chosen. */
    get used() {
      return this.content.panels.filter((panel) => this.of(panel).length > 0);
    }

    of(panel) {
      return panel.lines[this.choice] ?? panel.lines[""] ?? [];
    }

    /** Return the lines of a panel as they are to be drawn, hidden ones left out. */
    lines(panel, everything = false) {
      const found = this.of(panel);
      return found
        .filter(([name]) => everything || !this.hidden.has(name))
        .map(([name, mean, low, high, n]) => {
          const line = { name, x: this.x, mean, low, high, n, look: this.content.looks[name] };
          if (!this.runs || this.mode === MEANS) return line;
          if (this.mode === ONE) {
            const values = this.values(panel, name, this.run) ?? this.x.map(() => null);
            return { ...line, low: null, high: null, n: null, mean: values };
          }
          if (everything) return line;
          const numbers = this.series.get(name).numbers;
          const every = Math.max(1, Math.ceil(numbers.length / MOST_DRAWN));
          const drawn = numbers.filter((_, place) => place % every === 0).map((run) => this.values(panel, name, run));
          return { ...line, singles: drawn.filter((values) => values !== null) };
        });
    }

    /** Return a run of a line, in the lower panel its difference from the base's; null where there is none. */
    values(panel, name, run) {
      const of = (variant) => {
        const own = this.series.get(variant);
        own.decoded ??= new Map(decoded(own, this.x.length).map((values, place) => [own.numbers[place], values]));
        return own.decoded.get(run) ?? null;
      };
      const values = of(name);
      if (!panel.isDifference || values === null) return values;
      const base = of(this.choice);
      return base && values.map((value, i) => this.runs.sign * (value - base[i]));
    }

    draw() {
      this.width = Math.max(this.stage.clientWidth, 280);
      const [first, last] = this.range.map((input) => (input.value === "" ? null : +input.value));
      const full = [this.xLog ? Math.max(this.x[0], 1) : 0, this.x[this.x.length - 1]];
      const xLimits = [Math.max(first ?? full[0], full[0]), Math.min(last ?? full[1], full[1])];
      const isRange = xLimits[0] < xLimits[1];
      this.panels = this.used.map((panel) => ({
        ...panel,
        label: panel.labels[this.choice] ?? panel.labels[""],
        log: this.yLog && !panel.isDifference,
        lines: this.lines(panel),
      }));
      const how = { width: this.width, xLabel: this.content.xLabel, xLog: this.xLog, xLimits: isRange ? xLimits : full };
      Object.assign(this, plot.draw(this.svg, this.panels, how));
      this.cross = element("line", { class: "cross", y1: this.downs[0].top, y2: this.downs[this.downs.length - 1].bottom });
      this.svg.append(this.cross);
      plot.light(this.svg, this.strong);
      this.mark();
      this.tell();
    }

    mark() {
      const x = this.across(this.x[this.at]);
      this.cross.setAttribute("x1", x);
      this.cross.setAttribute("x2", x);
    }

    /** Write the table: a button for each line, its numbers in each panel at the place of the slider. */
    tell() {
      const used = this.used;
      const all = used.map((panel) => new Map(this.lines(panel, true).map((line) => [line.name, line])));
      const head = (words) => element("th", { scope: "col", class: "number" }, words);
      const rows = [...new Set(all.flatMap((lines) => [...lines.keys()]))].map((name) => {
        const cells = all.flatMap((lines, place) => this.cells(lines.get(name), used[place]));
        return element("tr", { class: this.strong === name ? "strong" : "" }, element("th", { scope: "row" }, this.button(name)), ...cells);
      });
      const heads = this.panels.flatMap((panel) => [head(panel.label), head("n")]);
      const table = element(
        "table",
        {},
        element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "Line"), ...heads)),
        element("tbody", {}, ...rows),
      );
      const focused = this.legend.contains(document.activeElement) ? document.activeElement.dataset.name : null;
      this.legend.replaceChildren(table);
      if (focused) [...this.legend.querySelectorAll("button")].find((one) => one.dataset.name === focused)?.focus();
      this.note.textContent = this.words();
    }

    cells(line, panel) {
      if (!line) return [element("td", { class: "number" }, "\u2013"), element("td", { class: "number" }, "\u2013")];
      const value = plot.say(line.mean[this.at], panel.whole);
      const interval = line.low ? this.interval(line, panel, this.at) : "";
      return [
        element("td", { class: "number" }, value, " ", element("span", { class: "small" }, interval)),
        element("td", { class: "number" }, line.n === null || line.n === undefined ? "" : plot.say(line.n, true)),
      ];
    }

    interval(line, panel, at) {
      if (line.n < 2 || line.low[at] === null) return "";
      return `[${plot.say(line.low[at], panel.whole)}, ${plot.say(line.high[at], panel.whole)}]`;
    }

    button(name) {
      const press = () => {
        this.hidden[this.hidden.has(name) ? "delete" : "add"](name);
        this.draw();
      };
      const light = (strong) => () => this.light(strong);
      const attributes = { type: "button", class: "key", "aria-pressed": String(!this.hidden.has(name)), "data-name": name };
      const events = { onclick: press, onpointerenter: light(name), onpointerleave: light(null), onfocus: light(name), onblur: light(null) };
      return element("button", { ...attributes, ...events }, plot.swatch(this.content.looks[name]), ` ${name}`);
    }

    /** Let a line stand out, without writing the table anew: the pointer, or the focus, is on it. */
    light(name) {
      if (this.strong === name) return;
      this.strong = name;
      plot.light(this.svg, name);
      for (const button of this.legend.querySelectorAll("button"))
        button.closest("tr").classList.toggle("strong", button.dataset.name === name);
    }

    words() {
      const { content } = this;
      if (!this.runs || this.mode === MEANS) return content.note;
      const kept = this.runs.variants.some((own) => own.left_out)
        ? ` Of ${this.runs.variants.reduce((sum, own) => sum + own.numbers.length + own.left_out, 0).toLocaleString("en-US")} single runs, evenly chosen ones are in this page; the means are of all.`
        : "";
      const rounded = " Single runs are rounded to one part in 65,535 of their range.";
      if (this.mode === ONE) return `Run ${this.run} of each line; where there is no line, it diverged, or is not in this page.${kept}${rounded}`;
      return `At most ${MOST_DRAWN} runs of a line are drawn.${kept}${rounded}`;
    }

    point(event) {
      const box = this.svg.getBoundingClientRect();
      const [px, py] = [((event.clientX - box.left) / box.width) * this.width, event.clientY - box.top];
      const place = this.downs.findIndex(({ top, bottom }) => py >= top && py <= bottom);
      if (place < 0 || px < this.across(this.across.limits[0])) return this.unpoint();
      const distances = this.x.map((value) => Math.abs(this.across(value) - px));
      this.at = distances.indexOf(Math.min(...distances));
      this.slider.set(this.at);
      const { down } = this.downs[place];
      const reachable = this.panels[place].lines.filter((line) => Number.isFinite(line.mean[this.at]) && line.mean[this.at] !== null);
      const away = (line) => Math.abs(down(line.mean[this.at]) - py);
      const nearest = reachable.reduce((best, line) => (best === null || away(line) < away(best) ? line : best), null);
      this.light(nearest?.name ?? null);
      this.mark();
      this.tell();
      if (!nearest) return this.unpoint();
      const panel = this.panels[place];
      const n = nearest.n === null || nearest.n === undefined ? "" : `, n = ${plot.say(nearest.n, true)}`;
      const interval = nearest.low ? ` ${this.interval(nearest, panel, this.at)}` : "";
      const episode = `${this.content.xOne} ${plot.say(this.x[this.at], true)}`;
      this.tip.textContent = `${nearest.name}, ${episode}: ${plot.say(nearest.mean[this.at], panel.whole)}${interval}${n}`;
      this.tip.hidden = false;
      this.tip.style.left = `${Math.min(px + 12, this.width - this.tip.offsetWidth)}px`;
      this.tip.style.top = `${Math.max(py - this.tip.offsetHeight - 8, 0)}px`;
    }

    unpoint() {
      this.tip.hidden = true;
      this.light(null);
    }

    /** Return a list of runs to search and to sort, each of which can be looked at on its own. */
    finder() {
      const names = this.runs.variants.map((own) => own.name);
      const totals = new Map(this.runs.variants.map((own) => [own.name, new Map(own.numbers.map((run, place) => [run, own.totals[place]]))]));
      const search = element("input", { type: "search", placeholder: "a number, or: diverged", "aria-label": "Search runs" });
      const count = element("p", { class: "small", role: "status" });
      const body = element("tbody");
      let order = null;
      let turned = 1;
      const text = (run) => [`run ${run}`, ...names.filter((name) => !totals.get(name).has(run)).map((name) => `${name} diverged`)].join(" ");
      const cell = (run, name) => {
        const value = totals.get(name).get(run);
        return element("td", { class: "number" }, value === undefined ? "diverged" : plot.say(value, this.runs.whole));
      };
      const choose = (run) => () => {
        this.run = run;
        this.mode = ONE;
        for (const input of this.modes.querySelectorAll("input")) input.checked = input.parentElement.textContent.trim() === ONE;
        this.draw();
        this.stage.scrollIntoView({ block: "nearest" });
      };
      const list = () => {
        const asked = search.value.trim().toLowerCase();
        const found = this.numbers.filter((run) => asked === "" || (/^\d+$/.test(asked) ? String(run).startsWith(asked) : text(run).includes(asked)));
        const value = (run) => totals.get(order)?.get(run) ?? Infinity;
        if (order !== null) found.sort((a, b) => turned * (value(a) - value(b)) || a - b);
        const row = (run) => {
          const button = element("button", { type: "button", onclick: choose(run) }, `Run ${run}`);
          return element("tr", {}, element("th", { scope: "row" }, button), ...names.map((name) => cell(run, name)));
        };
        body.replaceChildren(...found.slice(0, MOST_LISTED).map(row));
        const some = found.length > MOST_LISTED ? `; the first ${MOST_LISTED} are listed` : "";
        count.textContent = `${found.length.toLocaleString("en-US")} of ${this.numbers.length.toLocaleString("en-US")} runs${some}. ${this.runs.label}.`;
      };
      const heads = names.map((name) => {
        const head = element("th", { scope: "col", class: "number" });
        const sort = () => {
          turned = order === name ? -turned : 1;
          order = name;
          for (const other of head.parentElement.cells) other.removeAttribute("aria-sort");
          head.setAttribute("aria-sort", turned > 0 ? "ascending" : "descending");
          list();
        };
        head.append(element("button", { type: "button", class: "quiet", onclick: sort }, name));
        return head;
      });
      search.addEventListener("input", list);
      list();
      const table = element("table", {}, element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "Run"), ...heads)), body);
      const scroll = element("div", { class: "scroll", tabindex: 0, role: "group", "aria-label": "Runs" }, table);
      const save = tuckerl.download("Download all of these runs as CSV", `${this.figure.id}-runs.csv`, () => this.csv(names));
      return element("details", { class: "finder" }, element("summary", {}, "Find a run"), search, count, scroll, element("p", {}, save));
    }

    csv(names) {
      const [upper] = this.content.panels;
      const rows = names.flatMap((name) =>
        this.series.get(name).numbers.flatMap((run) =>
          this.values(upper, name, run).map((value, i) => [name, run, this.x[i], +value.toPrecision(6)]),
        ),
      );
      return tuckerl.csv([["variant", "run", this.content.xOne, "value"], ...rows]);
    }
  }

  tuckerl.kinds.lines = (place, content, figure) => new Lines(place, content, figure);
})();
