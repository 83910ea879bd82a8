"use strict";
// Panels of curves over a common axis, drawn as SVG: what figures of curves are made of.
tuckerl.plot = (() => {
  const { element } = tuckerl;
  const MARGIN = { left: 74, right: 12, top: 12, bottom: 6 };
  const HEIGHT = 250;
  const AXIS = 44; // below the last panel
  const LONGEST = 44; // letters beside a panel
  const MOST_BANDS = 12;

  /** Return a number as pages word it. */
  function say(value, whole) {
    if (value === null || value === undefined || Number.isNaN(value)) return "\u2013";
    const how = whole || Math.abs(value) >= 1000 ? { maximumFractionDigits: 0 } : { maximumSignificantDigits: 4 };
    return value.toLocaleString("en-US", how).replace(/^-0$/, "0").replace("-", "\u2212");
  }

  /** Return round numbers within the limits: about `count` of them, or on a logarithmic axis 1, 2 and 5 of each power. */
  function ticks([low, high], count, log) {
    const found = [];
    if (log) {
      for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
        for (const digit of [1, 2, 5]) found.push(digit * 10 ** power);
      const inside = found.filter((tick) => tick >= low && tick <= high);
      return inside.length > 1 ? inside : [low, high];
    }
    const rough = (high - low) / count;
    const unit = 10 ** Math.floor(Math.log10(rough));
    const step = unit * [1, 2, 5, 10].find((factor) => factor * unit >= rough);
    for (let place = Math.ceil(low / step); place * step <= high; place++) found.push(place * step);
    return found;
  }

  /** Return what turns values into places between two ends, and its limits; those that are not positive have no logarithm. */
  function scale([low, high], [from, to], log) {
    const map = log ? Math.log : (value) => value;
    const place = (value) => from + ((map(value) - map(low)) / (map(high) - map(low))) * (to - from);
    place.limits = [low, high];
    place.log = log;
    return place;
  }

  /** Return the limits of finite values, a little apart; on a logarithmic axis of the positive ones. */
  function limits(values, log, pad = 0.04) {
    let [low, high] = [Infinity, -Infinity];
    for (const value of values) {
      if (value === null || !Number.isFinite(value) || (log && value <= 0)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    if (low > high) return log ? [1, 10] : [0, 1];
    if (log) return low === high ? [low / 2, high * 2] : [low, high];
    if (low === high) return [low - (Math.abs(low) || 1) / 10, high + (Math.abs(high) || 1) / 10];
    return [low - pad * (high - low), high + pad * (high - low)];
  }

  /** Return the path of a line through the finite points. */
  function path(x, y, across, down) {
    let d = "";
    let pen = "M";
    for (let i = 0; i < x.length; i++) {
      const isGap = y[i] === null || Number.isNaN(y[i]) || (down.log && y[i] <= 0) || (across.log && x[i] <= 0);
      if (!isGap) d += `${pen}${across(x[i]).toFixed(1)},${down(y[i]).toFixed(1)}`;
      pen = isGap ? "M" : "L";
    }
    return d;
  }

  function band(x, low, high, across, down) {
    const floor = down.log ? low.map((value) => (value === null ? null : Math.max(value, down.limits[0]))) : low;
    const there = path(x, high, across, down);
    const back = path([...x].reverse(), [...floor].reverse(), across, down);
    return there && back ? `${there}L${back.slice(1).replaceAll("M", "L")}Z` : "";
  }

  const DASHES = { solid: "", dashed: "7 4", dotted: "2 3", dashdot: "7 3 2 3" };

  function stroke(look, more = {}) {
    return {
      fill: "none",
      "stroke-width": look.width * 1.1,
      "stroke-dasharray": DASHES[look.dash] || null,
      style: `stroke:var(--${look.colour})`,
      "vector-effect": "non-scaling-stroke",
      ...more,
    };
  }

  /** Return a short piece of a line, as it stands beside its name. */
  function swatch(look) {
    const line = element("line", { x1: 1, x2: 29, y1: 6, y2: 6, ...stroke(look, { "stroke-width": look.width * 1.3 }) });
    return element("svg", { width: 30, height: 12, "aria-hidden": "true", class: "swatch" }, line);
  }

  /** Return words that fit beside a panel: what is in the middle of very long ones is left out, as in print. */
  function shortened(words) {
    const half = Math.floor(LONGEST / 2);
    return words.length <= LONGEST ? words : `${words.slice(0, half)} \u2026 ${words.slice(-half)}`;
  }

  function axes(panel, across, down, top, isLast, width, xLabel) {
    const parts = [];
    const bottom = top + HEIGHT;
    for (const tick of ticks(down.limits, 5, down.log)) {
      const y = down(tick);
      parts.push(element("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: y, y2: y, class: "grid" }));
      parts.push(element("text", { x: MARGIN.left - 6, y: y + 4, "text-anchor": "end" }, say(tick, panel.whole)));
    }
    for (const tick of ticks(across.limits, Math.max(3, width / 110), across.log)) {
      const x = across(tick);
      parts.push(element("line", { x1: x, x2: x, y1: bottom, y2: bottom + 4, class: "axis" }));
      if (isLast) parts.push(element("text", { x, y: bottom + 17, "text-anchor": "middle" }, say(tick, true)));
    }
    parts.push(element("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: bottom, y2: bottom, class: "axis" }));
    const middle = top + HEIGHT / 2;
    const turned = { x: 13, y: middle, "text-anchor": "middle", transform: `rotate(-90 13 ${middle})` };
    parts.push(element("text", turned, shortened(panel.label)));
    if (isLast) parts.push(element("text", { x: (MARGIN.left + width) / 2, y: bottom + 36, "text-anchor": "middle" }, xLabel));
    return parts;
  }

  /**
   * Draw panels into an SVG element and return where things are.
   *
   * panels: [{label, whole, log, reference, lines: [{name, x, mean, low, high, look, singles: [values], n}]}]
   * how: {width, xLabel, xLog, xLimits}
   */
  function draw(svg, panels, how) {
    const { width } = how;
    const height = panels.length * (MARGIN.top + HEIGHT + MARGIN.bottom) + AXIS;
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("height", height);
    svg.replaceChildren();
    const across = scale(how.xLimits, [MARGIN.left, width - MARGIN.right], how.xLog);
    const inside = (x) => x >= how.xLimits[0] && x <= how.xLimits[1];
    const downs = panels.map((panel, place) => {
      const top = MARGIN.top + place * (MARGIN.top + HEIGHT + MARGIN.bottom);
      const shown = panel.lines.flatMap((line) =>
        [line.mean, line.low ?? [], line.high ?? [], ...(line.singles ?? [])].flatMap((values) =>
          values.filter((_, i) => inside(line.x[i])),
        ),
      );
      const reference = panel.reference ? [panel.reference.value] : [];
      const down = scale(limits([...shown, ...reference], panel.log), [top + HEIGHT, top], panel.log);
      const clip = element("svg", { x: MARGIN.left, y: top, width: width - MARGIN.left - MARGIN.right, height: HEIGHT });
      clip.setAttribute("viewBox", `${MARGIN.left} ${top} ${width - MARGIN.left - MARGIN.right} ${HEIGHT}`);
      svg.append(...axes(panel, across, down, top, place === panels.length - 1, width, how.xLabel), clip);
      if (panel.reference) {
        const y = down(panel.reference.value);
        clip.append(element("line", { x1: 0, x2: width, y1: y, y2: y, class: "reference" }));
        clip.append(element("text", { x: MARGIN.left + 6, y: y - 4 }, panel.reference.label));
      }
      const kind = panel.lines.length > MOST_BANDS ? "band crowded" : "band"; // seen where its line stands out
      for (const line of panel.lines)
        if (line.low) {
          const fill = { d: band(line.x, line.low, line.high, across, down), style: `fill:var(--${line.look.colour})` };
          clip.append(element("path", { class: kind, "data-name": line.name, ...fill }));
        }
      for (const line of panel.lines)
        if (line.singles?.length) {
          const d = line.singles.map((values) => path(line.x, values, across, down)).join("");
          const thin = stroke(line.look, { "stroke-width": 0.8, "stroke-dasharray": null });
          clip.append(element("path", { class: "single", "data-name": line.name, d, ...thin }));
        }
      for (const line of panel.lines) {
        const d = path(line.x, line.mean, across, down);
        clip.append(element("path", { class: "mean", "data-name": line.name, d, ...stroke(line.look) }));
      }
      return { down, top, bottom: top + HEIGHT };
    });
    return { across, downs };
  }

  /** Let the line of a name stand out, or with null all alike. */
  function light(svg, name) {
    for (const part of svg.querySelectorAll("path[data-name]")) {
      part.classList.toggle("strong", part.dataset.name === name);
      part.classList.toggle("faded", name !== null && part.dataset.name !== name);
    }
    for (const part of svg.querySelectorAll("path.mean.strong")) part.parentElement.append(part); // above the others
  }

  return { draw, light, say, swatch };
})();
