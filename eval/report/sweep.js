// The page of a sweep: heat maps with intervals, limits per factor, each cell with its command.
const mix = (a, b, t) => `color-mix(in srgb, ${b} ${Math.round(100 * t)}%, ${a})`;

// 0 bad, 1 good.
const heatColor = (t) => (t < 0.5 ? mix("var(--heat-low)", "var(--heat-mid)", 2 * t) : mix("var(--heat-mid)", "var(--heat-high)", 2 * t - 1));

const metricName = (path) => path.split(".").pop();

class SweepPage {
  constructor(data) {
    this.data = data;
    this.byPlace = new Map(data.points.map((p) => [p.at.join(), p]));
    this.metrics = [...new Set(data.points.flatMap((p) => Object.keys(p.values)))].filter((m) => data.points.some((p) => p.values[m]));
    this.metric = ["object.success_5cm_5deg", "object.mean_error_m", ...this.metrics].find((m) => this.metrics.includes(m)) ?? null;
    const numeric = (f) => f.values.every((v) => v !== "" && Number.isFinite(Number(v)));
    const order = data.factors.map((f, i) => i).sort((a, b) => (numeric(data.factors[b]) - numeric(data.factors[a])) || data.factors[b].values.length - data.factors[a].values.length);
    this.columns = order[0];
    const method = data.factors.findIndex((f) => f.name === "method");
    this.rows = method >= 0 && method !== this.columns ? method : order[1] ?? -1;
    this.box = el("div", {});
    this.detail = el("div", {});
  }

  // 0..1 for the colour: shares as they are, errors by their logarithm.
  goodness(metric, value) {
    const better = metricStyle(metricName(metric))[3];
    if (this.data.shares.includes(metric) || metricName(metric) === "add_auc_10cm") return better < 0 ? 1 - value : value;
    if (better === 0) return 0.5;
    if (!this.ranges) this.ranges = {};
    if (!this.ranges[metric]) {
      const all = this.data.points.map((p) => p.values[metric]?.[0]).filter((v) => isNumber(v) && v > 0).map(Math.log);
      this.ranges[metric] = [Math.min(...all), Math.max(...all)];
    }
    const [low, high] = this.ranges[metric], t = high > low ? (Math.log(Math.max(value, Math.exp(low))) - low) / (high - low) : 0.5;
    return better < 0 ? 1 - t : t;
  }

  others() { return this.data.factors.map((_, i) => i).filter((i) => i !== this.columns && i !== this.rows); }

  combinations(list) {
    return list.reduce((all, f) => all.flatMap((c) => this.data.factors[f].values.map((_, v) => [...c, [f, v]])), [[]]);
  }

  cell(at) {
    const point = this.byPlace.get(at.join());
    if (!point) return el("td", {}, el("button", { type: "button", disabled: true, class: "note" }, "not run"));
    const value = point.values[this.metric], broken = point.cells.filter((c) => c.status !== "done").length, style = metricStyle(metricName(this.metric));
    const button = el("button", { type: "button", style: value ? `background: ${heatColor(this.goodness(this.metric, value[0]))}` : "background: var(--wash)", title: "the cells and their commands" },
      value ? style[2](value[0]) : "failed", value ? el("small", {}, `${style[2](value[1])} – ${style[2](value[2])}`) : null, broken && value ? el("small", {}, `${broken} failed`) : null);
    button.addEventListener("click", () => this.showDetail(point));
    return el("td", {}, button);
  }

  heat(fixed) {
    const { factors } = this.data, rowValues = this.rows >= 0 ? factors[this.rows].values : [""];
    const at = (r, c) => {
      const place = factors.map(() => 0);
      for (const [f, v] of fixed) place[f] = v;
      if (this.rows >= 0) place[this.rows] = r;
      if (this.columns >= 0) place[this.columns] = c;
      return place;
    };
    const columnValues = this.columns >= 0 ? factors[this.columns].values : [""];
    return el("div", {}, el("h3", {}, fixed.map(([f, v]) => `${factors[f].name}: ${factors[f].values[v]}`).join(", ")),
      el("div", { class: "scroll" }, el("table", { class: "heat" }, el("thead", {}, el("tr", {}, el("th", {}, this.columns >= 0 ? factors[this.columns].name : ""), columnValues.map((v) => el("th", {}, v)))),
        el("tbody", {}, rowValues.map((v, r) => el("tr", {}, el("th", {}, v), columnValues.map((_, c) => this.cell(at(r, c)))))))));
  }

  draw() {
    const [label, unit] = metricStyle(metricName(this.metric ?? ""));
    this.box.replaceChildren(el("div", { class: `heats${this.columns >= 0 && this.data.factors[this.columns].values.length > 6 ? " wide" : ""}` }, this.combinations(this.others()).map((fixed) => this.heat(fixed))),
      el("p", { class: "note" }, `${label[0].toUpperCase()}${label.slice(1)}${unit ? `, ${unit}` : ""}: mean over the seeds; beneath, a 95% interval (${this.data.shares.includes(this.metric) ? "Wilson, over all frames as if they were independent: the true one is wider" : "bootstrap over the seeds"}). Click a field for its commands.`));
  }

  showDetail(point) {
    this.detail.replaceChildren(el("h3", {}, point.at.map((v, f) => `${this.data.factors[f].name}: ${this.data.factors[f].values[v]}`).join(", ")),
      ...point.cells.map((c) => el("div", {}, el("p", {}, `seed ${c.seed}: `, el("span", { class: c.status === "done" ? "met" : "missed" }, c.status + (c.status === "done" ? "" : ` (${c.code})`))), commandBox(c.command))));
    this.detail.scrollIntoView({ block: "nearest", behavior: "smooth" });
  }

  // For each numeric factor and each combination of the others: to where `success` holds at 95%.
  limits() {
    const metric = "object.success_5cm_5deg", bound = 0.95;
    if (!this.metrics.includes(metric)) return null;
    const numeric = this.data.factors.map((f, i) => i).filter((i) => this.data.factors[i].values.length > 1 && this.data.factors[i].values.every((v) => Number.isFinite(Number(v))));
    const parts = numeric.map((f) => {
      const others = this.data.factors.map((_, i) => i).filter((i) => i !== f);
      const rows = this.combinations(others).map((fixed) => {
        const series = this.data.factors[f].values.map((v, k) => {
          const place = this.data.factors.map(() => 0);
          for (const [i, value] of fixed) place[i] = value;
          place[f] = k;
          return [Number(v), this.byPlace.get(place.join())?.values[metric]?.[0]];
        });
        const good = series.filter(([, y]) => isNumber(y) && y >= bound).length;
        // From its easier end: the one where it succeeds more often.
        const ends = [series[0][1] ?? 0, series[series.length - 1][1] ?? 0], ordered = ends[0] >= ends[1] ? series : [...series].reverse();
        let last = null;
        for (const [x, y] of ordered) { if (!isNumber(y) || y < bound) break; last = x; }
        const text = good === series.length ? "everywhere" : last === null ? "nowhere" : `as far as ${last}`;
        return el("tr", {}, fixed.map(([i, v]) => el("td", { class: "text" }, this.data.factors[i].values[v])), el("td", { class: `text${last === null ? " worse" : ""}` }, text));
      });
      return el("div", {}, el("h3", {}, `Along ${this.data.factors[f].name}`), el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, others.map((i) => el("th", { class: "text" }, this.data.factors[i].name)), el("th", { class: "text" }, "holds"))), el("tbody", {}, rows))));
    });
    return parts.length ? section("How far it holds", el("p", { class: "note" }, "Where at least 95% of the frames are within 5 cm and 5°, from the easier end of each factor."), el("div", { class: "columns" }, parts)) : null;
  }

  picker() {
    const choose = (label, options, value, set) => {
      const select = el("select", {}, options.map(([v, text]) => el("option", { value: String(v), selected: v === value }, text)));
      select.addEventListener("change", () => { set(select.value); this.draw(); });
      return el("label", {}, `${label} `, select);
    };
    const factors = this.data.factors.map((f, i) => [i, f.name]);
    return el("div", { class: "picker" },
      choose("Figure", this.metrics.map((m) => [m, `${m.startsWith("camera") ? "camera" : "object"}: ${metricStyle(metricName(m))[0]}`]), this.metric, (v) => (this.metric = v)),
      factors.length > 1 ? choose("across", factors, this.columns, (v) => { if (Number(v) === this.rows) this.rows = this.columns; this.columns = Number(v); }) : null,
      factors.length > 1 ? choose("down", factors, this.rows, (v) => { if (Number(v) === this.columns) this.columns = this.rows; this.rows = Number(v); }) : null);
  }
}

const buildSweepPage = (page, data) => {
  const sweep = new SweepPage(data), missed = data.thresholds.filter((t) => !t.met).length, cells = data.points.flatMap((p) => p.cells), broken = cells.filter((c) => c.status !== "done");
  page.append(el("section", {}, el("h1", {}, data.name), el("div", { class: "facts" }, [`${cells.length} of ${data.cells} cells`, `${data.factors.map((f) => `${f.values.length} × ${f.name}`).join(", ")}`, `${data.seeds.length} seeds`].map((t) => el("span", {}, t))),
    data.thresholds.length ? el("p", { class: "verdict" }, el("strong", { class: missed ? "missed" : "met" }, missed ? `${missed} of ${data.thresholds.length} thresholds missed` : "All thresholds are met"))
      : el("p", { class: "verdict note" }, cells.length < data.cells ? "Not all cells have been run; there is no verdict yet." : "This sweep sets no thresholds."),
    el("ul", { class: "expectations" }, data.thresholds.map((t) => el("li", {}, el("span", { class: t.met ? "met" : "missed" }, t.met ? "✓" : "✗"), el("code", {}, t.text), el("span", { class: "note" }, t.detail))))));
  if (sweep.metric) page.append(section("Map", sweep.picker(), sweep.box, sweep.detail), sweep.limits() || "");
  else page.append(el("p", { class: "note" }, "No cell has a result."));
  if (broken.length) page.append(section(`Cells that failed (${broken.length})`, filteredTable("options", ["cell", "what happened", "command"], broken, "Filter cells", (c) =>
    el("tr", {}, el("td", {}, c.cell), el("td", { class: "missed" }, `${c.status} (${c.code})`), el("td", { class: "text" }, el("code", {}, c.command))))));
  page.append(section("What was varied", el("pre", { class: "card", style: "padding: 1rem; overflow-x: auto" }, data.text)));
  if (sweep.metric) sweep.draw();
  return { sweep };
};

// The page of the paper's tables.
const buildReproducePage = (page, data) => {
  page.append(el("section", {}, el("h1", {}, "The paper’s tables"), el("p", { class: "verdict" }, data.headline)));
  for (const table of data.tables) {
    const cell = (text, k) => {
      const [, ours, paper] = text.match(/^(.*?)( \([^()]*\))?$/);
      return el("td", { class: k === 0 ? "text" : "" }, ours, paper ? el("span", { class: "note" }, paper) : null);
    };
    page.append(section(table.title, el("p", { class: "note" }, table.note), el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, table.header.map((h) => el("th", {}, h)))),
      el("tbody", {}, table.rows.map((row) => el("tr", { class: row[0] === "All" ? "total" : "" }, row.map(cell))))))));
  }
  const figure = new DOMParser().parseFromString(data.figure, "image/svg+xml").documentElement;
  page.append(section("Figure 4: the object’s error over time", el("div", { class: "svg" }, document.importNode(figure, true))));
  return {};
};
