// Plots over time with one playhead; a click or drag moves it.
class Plots {
  constructor(box, timeline) {
    this.box = box; this.timeline = timeline; this.plots = [];
    timeline.onChange((index, source) => { if (source !== "state") this.follow(index); });
    new ResizeObserver(() => this.resize()).observe(box);
    themeListeners.push(() => this.rebuild());
  }

  // series: [{name, color: () => css, values, dash, fill}], `shade`: [{from, to, color}], `marks`: [{t, color}], `show`: a value as text.
  add(options) {
    const head = el("div", { class: "head" }), body = el("div", {});
    const plot = { options, head, body, log: false };
    this.box.append(el("div", { class: "plot" }, head, body));
    plot.values = options.series.map(() => el("span", {}));
    plot.swatches = options.series.map(() => el("span", { class: "swatch" }));
    head.append(el("b", {}, options.title), ...options.series.map((s, k) => el("span", { class: "val" }, plot.swatches[k], s.name, plot.values[k])));
    if (options.logable) {
      const button = el("button", { type: "button", "aria-pressed": "false" }, "log");
      button.addEventListener("click", () => {
        plot.log = !plot.log;
        button.setAttribute("aria-pressed", plot.log);
        button.textContent = plot.log ? "linear" : "log";
        this.make(plot);
      });
      head.append(button);
    }
    this.plots.push(plot);
    this.make(plot);
  }

  make(plot) {
    const { options } = plot, ink = cssColor("--soft"), rule = cssColor("--rule");
    if (plot.u) plot.u.destroy();
    const data = [this.timeline.times, ...options.series.map((s) => (plot.log ? s.values.map((v) => (v > 0 ? v : null)) : s.values))];
    const axis = { stroke: ink, font: "11px system-ui, sans-serif", grid: { stroke: rule, width: 1 }, ticks: { stroke: rule, size: 4 } };
    options.series.forEach((s, k) => (plot.swatches[k].style.color = s.color()));
    plot.u = new uPlot({
      width: Math.max(200, this.box.clientWidth), height: options.height || 150,
      padding: [8, 8, 0, 0],
      cursor: { drag: { x: false, y: false }, points: { show: false }, x: false, y: false },
      legend: { show: false },
      scales: {
        x: { time: false },
        y: { distr: plot.log ? 3 : 1, range: (u, low, high) => (plot.log ? [low > 0 ? low / 1.3 : 0.01, high > 0 ? high * 1.3 : 1] : options.range || [0, high > 0 ? high * 1.08 : 1]) },
      },
      axes: [
        { ...axis, size: 26, values: (u, ticks) => ticks.map((t) => `${t} s`) },
        { ...axis, size: 52, values: (u, ticks) => ticks.map((v) => (v === null ? "" : options.tick ? options.tick(v) : String(v))) },
      ],
      series: [{}, ...options.series.map((s) => ({
        label: s.name, stroke: s.color(), width: 1.5, dash: s.dash, spanGaps: false, points: { show: false },
        fill: s.fill ? `color-mix(in srgb, ${s.color()} 22%, transparent)` : undefined }))],
      hooks: { drawClear: [(u) => this.background(u, options)] },
    }, data, plot.body);
    plot.head_ = el("div", { class: "playhead" });
    plot.u.over.append(plot.head_);
    const seek = (event) => {
      const x = event.clientX - plot.u.over.getBoundingClientRect().left;
      this.timeline.setTime(plot.u.posToVal(x, "x"));
    };
    plot.u.over.addEventListener("pointerdown", (event) => {
      plot.u.over.setPointerCapture(event.pointerId);
      seek(event);
      plot.u.over.onpointermove = seek;
    });
    for (const name of ["pointerup", "pointercancel"]) plot.u.over.addEventListener(name, () => (plot.u.over.onpointermove = null));
    this.followOne(plot, this.timeline.index);
  }

  background(u, options) {
    const { ctx, bbox } = u;
    ctx.save();
    for (const { from, to, color } of options.shade || []) {
      const a = u.valToPos(from, "x", true), b = u.valToPos(to, "x", true);
      ctx.fillStyle = color();
      ctx.globalAlpha = 0.16;
      ctx.fillRect(a, bbox.top, Math.max(1, b - a), bbox.height);
    }
    ctx.globalAlpha = 0.7;
    for (const { t, color } of options.marks || []) {
      ctx.fillStyle = color();
      ctx.fillRect(u.valToPos(t, "x", true), bbox.top, devicePixelRatio, bbox.height);
    }
    ctx.restore();
  }

  followOne(plot, index) {
    if (!this.timeline.length) return;
    plot.head_.style.left = `${plot.u.valToPos(this.timeline.times[index], "x")}px`;
    plot.options.series.forEach((s, k) => (plot.values[k].textContent = plot.options.show(s.values[index])));
  }
  follow(index) { for (const plot of this.plots) this.followOne(plot, index); }
  resize() { for (const plot of this.plots) plot.u.setSize({ width: Math.max(200, this.box.clientWidth), height: plot.options.height || 150 }), this.followOne(plot, this.timeline.index); }
  rebuild() { for (const plot of this.plots) this.make(plot); }
}
