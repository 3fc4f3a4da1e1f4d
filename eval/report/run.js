// The page of one run, or of two side by side.
const EVENT_COLOR = { lost: "--lost", dropped: "--lost", reset: "--lost", started: "--camera", relocalised: "--camera", detected: "--object-0", reinitialised: "--object-0", tracked: "--object-0", moving: "--object-0", resting: "--object-0", rejected: "--faint" };
const eventColor = (name) => cssColor(EVENT_COLOR[name] || "--faint");
const MANY_EVENTS = 60;  // of one kind: ticks of these would hide everything else

// Each number with its dotted place in metrics.json.
const metricCell = (path, key, value) =>
  el("td", { "data-path": path, "data-value": value === null || value === undefined ? "null" : String(value), title: isNumber(value) ? String(value) : "not known" }, metricStyle(key)[2](value));

// rows: keys; columns: [{head, part(run), path}]. With two runs each column is there twice, with the change.
const metricTable = (runs, columns) => {
  const keys = [];
  for (const run of runs) for (const column of columns) for (const key of Object.keys(column.part(run) || {})) if (!keys.includes(key)) keys.push(key);
  const heads = columns.flatMap((c) => (runs.length === 1 ? [c.head] : [`${c.head} A`.trim(), `${c.head} B`.trim(), "change"]));
  const body = keys.map((key) => {
    const [label, unit, , better] = metricStyle(key);
    const cells = columns.flatMap((column) => {
      const values = runs.map((run) => (column.part(run) || {})[key]);
      const shown = runs.map((run, k) => metricCell(`${k ? "B:" : ""}${column.path}.${key}`, key, values[k] ?? null));
      if (runs.length === 2) {
        const change = isNumber(values[0]) && isNumber(values[1]) && values[0] !== 0 ? (values[1] - values[0]) / Math.abs(values[0]) : null;
        const good = change === null || better === 0 || Math.abs(change) < 0.005 ? "" : Math.sign(change) === better ? "better" : "worse";
        shown.push(el("td", { class: good }, change === null ? "" : `${change > 0 ? "+" : "−"}${Math.abs(100 * change).toFixed(Math.abs(change) < 0.1 ? 1 : 0)}%`));
      }
      return shown;
    });
    return el("tr", {}, el("td", { class: "text" }, label, unit ? el("span", { class: "note" }, `, ${unit}`) : null), cells);
  });
  return el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, el("th", {}, ""), heads.map((h) => el("th", {}, h)))), el("tbody", {}, body)));
};

const tile = (name, value, unit, more) =>
  el("div", { class: "tile" }, el("div", { class: "name" }, name), el("div", { class: "value" }, value, unit && value !== DASH ? el("span", { class: "unit" }, unit) : null), more ? el("div", { class: "more" }, more) : null);

// The worst of all objects, with its name where there are several.
const worstObject = (metrics, key, worst) => {
  const known = Object.entries(metrics.objects).filter(([, m]) => isNumber(m[key]));
  if (!known.length) return [null, ""];
  const [name, m] = known.reduce((a, b) => (worst(b[1][key], a[1][key]) ? b : a));
  return [m[key], Object.keys(metrics.objects).length > 1 ? name : ""];
};

const summaryTiles = (run) => {
  const m = run.metrics, more = (a, b) => a > b, less = (a, b) => a < b;
  const [error, errorName] = worstObject(m, "mean_error_m", more), [success, successName] = worstObject(m, "success_5cm_5deg", less), [claims, claimsName] = worstObject(m, "false_claim_ratio", more);
  const length = (v) => (isNumber(v) && v >= 0.1 ? [shortNumber(100 * v), "cm"] : [metricStyle("mean_error_m")[2](v), "mm"]);
  return el("div", { class: "tiles" },
    tile("Object error, mean", ...length(error), errorName), tile("Within 5 cm and 5°", percent(success), "%", successName),
    tile("Camera error (ATE)", ...length(m.camera.ate_mean_m)), tile("False claims", percent(claims), "%", claimsName),
    tile("Frames", String(m.frames), "", m.timing && isNumber(m.timing.frames_per_s) ? `${shortNumber(m.timing.frames_per_s)} per second` : ""));
};

const verdict = (run) => {
  const list = Array.isArray(run.verdict) ? run.verdict : [];
  const missed = list.filter((v) => !v.met).length;
  if (!run.metrics.frames) return el("p", { class: "verdict" }, "No frame was processed: there is nothing to judge.");
  if (!list.length) {
    const known = Object.values(run.metrics.objects).some((m) => isNumber(m.mean_error_m)) || isNumber(run.metrics.camera.ate_mean_m);
    const nothing = Object.values(run.metrics.objects).every((m) => m.reported_ratio === 0);
    return el("p", { class: "verdict note" }, nothing ? "No object was found in any frame." : known ? "Measured against the truth; nothing was demanded (--expect)." : "There is no truth to measure against; the estimates are shown as they are.");
  }
  return el("div", {}, el("p", { class: "verdict" }, el("strong", { class: missed ? "missed" : "met" }, missed ? `${missed} of ${list.length} expectations missed` : list.length === 1 ? "The expectation is met" : `All ${list.length} expectations are met`)),
    el("ul", { class: "expectations" }, list.map((v) => el("li", {}, el("span", { class: v.met ? "met" : "missed", "aria-label": v.met ? "met" : "missed" }, v.met ? "✓" : "✗"), el("code", {}, v.text), v.detail ? el("span", { class: "note" }, v.detail.replace(/^missed: .*? \(/, "(")) : null))));
};

const header = (runs) => {
  const facts = (run, letter) => el("div", { class: "facts" }, letter ? el("b", {}, letter) : null, [run.name, `method ${run.metrics.method}`, `start ${run.metrics.initial}`, `seed ${run.metrics.seed}`,
    isNumber(run.metrics.start_frame) ? `first estimate in frame ${run.metrics.start_frame}` : "never started"].map((t) => el("span", {}, t)));
  return el("section", {}, el("h1", {}, [...new Set(runs.map((r) => r.metrics.scene))].join(" and ")), runs.length === 1 ? facts(runs[0]) : runs.map((r, k) => facts(r, "AB"[k])));
};

// Runs of frames in which the tracker does not hold any object, as bands of time.
const lostBands = (run) => {
  const bands = [];
  run.objects.forEach((object) => object.held.forEach((held, i) => {
    if (held !== 0) return;
    const from = run.t_s[i], to = run.t_s[Math.min(i + 1, run.t_s.length - 1)];
    const last = bands[bands.length - 1];
    if (last && Math.abs(last.to - from) < 1e-6) last.to = to; else bands.push({ from, to, color: () => cssColor("--lost") });
  }));
  return bands;
};

const eventMarks = (run) => {
  const count = {};
  for (const e of run.events) count[e.event] = (count[e.event] || 0) + 1;
  return run.events.filter((e) => count[e.event] <= MANY_EVENTS).map((e) => ({ t: e.t_s, color: () => eventColor(e.event), event: e.event }));
};

const buildPlots = (box, runs, timeline, indexIn) => {
  const plots = new Plots(box, timeline), shade = lostBands(runs[0]), marks = eventMarks(runs[0]);
  const onTime = (k, values, factor) => (k === 0 ? values : timeline.times.map((_, i) => values[indexIn(k, i)] ?? null)).map((v) => (isNumber(v) ? v * factor : null));
  const letter = (k) => (runs.length > 1 ? ` ${"AB"[k]}` : "");
  const series = (pick, factor, fill) => runs.flatMap((run, k) => run.objects.map((object, i) => ({
    name: object.name + letter(k), color: () => objectColor(i + (k ? run.objects.length : 0)), values: onTime(k, pick(object), factor), dash: k ? [5, 3] : undefined, fill })));
  const camera = (pick, factor) => runs.map((run, k) => ({ name: `camera${letter(k)}`, color: () => cssColor("--camera"), values: onTime(k, pick(run), factor), dash: k ? [5, 3] : undefined }));
  const some = (list) => list.filter((s) => s.values.some(isNumber));
  const add = (options) => { if (options.series.length) plots.add({ shade, marks, ...options }); };
  add({ title: "Position error, mm", series: [...some(series((o) => o.error_m, 1e3)), ...some(camera((r) => r.camera.error_m, 1e3))], show: shortNumber, logable: true, height: 190 });
  add({ title: "Rotation error, °", series: some(series((o) => o.error_rad, DEGREES)), show: shortNumber, logable: true, height: 130 });
  add({ title: "Health", series: [...some(series((o) => o.health, 1)), ...some(camera((r) => r.odometry.health, 1))], show: shortNumber, range: [0, 1.02], height: 120 });
  add({ title: "Visible fraction", series: some(series((o) => o.visible, 1, runs.length === 1)), show: (v) => (isNumber(v) ? `${percent(v)} %` : DASH), range: [0, 1.02], tick: (v) => `${Math.round(100 * v)}%`, height: 120 });
  return plots;
};

const buildStage = (runs, timeline, indexIn, page) => {
  const stage = el("div", { class: "stage" });
  runs.forEach((run, k) => {
    const video = videoElement(k), pane = el("div", { class: "pane" });
    if (video) {
      pane.append(video);
      followTimeline(video, timeline, (i) => indexIn(k, i) * run.video_step, Math.max(1, run.metrics.frames), k === 0 && runs.length === 1);
    } else pane.append(el("div", { class: "empty" }, run.metrics.frames ? "This run wrote no video." : "No frames."));
    if (runs.length > 1) pane.append(el("span", { class: "label" }, "AB"[k]));
    const known = run.objects.some((object) => object.true.some(Boolean));
    stage.append(el("div", {}, pane, k === 0 ? el("div", { class: "under" }, known ? swatch("--truth", "truth") : "", swatch("--object-0", "estimate, held"), swatch("--lost", "estimate, not held by the tracker")) : null));
  });
  const pane = el("div", { class: "pane view" }), under = el("div", { class: "under" });
  stage.append(el("div", {}, pane, under));
  page.append(stage);
  let viewer = null;
  try {
    viewer = new Viewer(pane, runs, timeline, indexIn);
    viewerControls(viewer, runs, under);
  } catch (error) {
    pane.replaceChildren(el("div", { class: "empty" }, `This browser shows no 3D (WebGL): ${error.message}`));
  }
  return viewer;
};

const swatch = (color, text) => el("span", { class: "layer", style: "cursor: default" }, el("span", { class: "swatch", style: `color: var(${color})` }), text);

const viewerControls = (viewer, runs, under) => {
  const colors = { "true camera": "--truth", "estimated camera": "--camera", "true objects": "--truth", "estimated objects": "--object-0", "tracker's ellipsoids": "--object-0", "final map's ellipsoids": "--map", "odometry points": "--camera" };
  for (const name of Object.keys(viewer.layers)) {
    const button = el("button", { class: "layer", type: "button", "aria-pressed": "true" }, el("span", { class: `swatch${name.includes("ellips") ? " dot" : ""}`, style: `color: var(${colors[name]})` }), name);
    button.addEventListener("click", () => {
      const on = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", on);
      viewer.setLayer(name, on);
    });
    under.append(button);
  }
  const useful = viewer.usefulExaggeration();
  if (useful !== null) {
    const text = el("span", {}), slider = el("input", { type: "range", min: "0", max: "2.5", step: "0.01", "aria-label": "size of the ellipsoids" });
    const apply = (factor) => {
      viewer.exaggeration = factor;
      text.textContent = `3σ × ${factor < 10 ? factor.toFixed(1) : factor.toFixed(0)}`;
      viewer.show(viewer.timeline.index);
    };
    slider.value = Math.log10(useful);
    slider.addEventListener("input", () => apply(10 ** slider.value));
    apply(useful);
    under.append(el("label", {}, slider, " ", text));
  }
  under.append(el("span", { class: "end" }, `grid ${viewer.gridStep_m >= 1 ? `${viewer.gridStep_m} m` : `${Math.round(100 * viewer.gridStep_m)} cm`}`, "  ", el("button", { class: "layer", type: "button", onclick: () => viewer.reset() }, "Reset view")));
};

const buildTransport = (run, timeline) => {
  const play = el("button", { class: "play", type: "button", "aria-label": "play" }, "▶"), where = el("div", { class: "where" });
  const slider = el("input", { type: "range", min: "0", max: String(Math.max(0, timeline.length - 1)), step: "1", value: "0", "aria-label": "frame" }), canvas = el("canvas", {});
  const bar = el("div", { class: "transport" }, el("div", { class: "inner" }, play, el("div", { class: "track" }, canvas, slider, el("span", { class: "ring" })), where));
  play.addEventListener("click", () => timeline.toggle());
  slider.addEventListener("input", () => timeline.set(Number(slider.value)));
  const bands = lostBands(run), marks = eventMarks(run);
  const draw = () => {
    const w = canvas.clientWidth, h = canvas.clientHeight, r = devicePixelRatio, c = canvas.getContext("2d");
    if (!w) return;
    canvas.width = w * r; canvas.height = h * r;
    c.scale(r, r);
    const first = timeline.times[0], span = Math.max(1e-9, timeline.times[timeline.length - 1] - first), x = (t) => 4 + (t - first) / span * (w - 8), y = h / 2;
    c.fillStyle = cssColor("--rule"); c.fillRect(4, y - 2, w - 8, 4);
    c.fillStyle = cssColor("--soft"); c.fillRect(4, y - 2, x(timeline.times[timeline.index]) - 4, 4);
    c.globalAlpha = 0.55;
    for (const b of bands) c.fillStyle = b.color(), c.fillRect(x(b.from), y - 5, Math.max(1, x(b.to) - x(b.from)), 10);
    c.globalAlpha = 1;
    for (const m of marks) c.fillStyle = m.color(), c.fillRect(x(m.t) - 0.75, y - 11, 1.5, 6);
    c.fillStyle = cssColor("--ink"); c.beginPath(); c.arc(x(timeline.times[timeline.index]), y, 6, 0, 7); c.fill();
  };
  timeline.onChange((index) => {
    slider.value = index;
    play.textContent = timeline.playing ? "❚❚" : "▶";
    play.setAttribute("aria-label", timeline.playing ? "stop" : "play");
    where.replaceChildren("frame ", el("b", {}, String(timeline.frames[index])), ` of ${timeline.frames[timeline.length - 1]}  ·  ${timeline.times[index].toFixed(2)} s`);
    draw();
  });
  new ResizeObserver(draw).observe(canvas);
  themeListeners.push(draw);
  document.body.append(bar);
};

const buildWorst = (run, timeline) => {
  if (!run.worst.length) return null;
  return section("Worst frames", el("div", { class: "sheet" }, run.worst.map((w) => el("button", { class: "shot card", type: "button", onclick: () => { timeline.setTime(w.t_s); scrollTo({ top: 0, behavior: "smooth" }); } },
    w.picture ? el("img", { src: w.picture, alt: `frame ${w.frame}`, loading: "lazy" }) : el("span", { class: "no-picture" }, "no video"),
    el("span", {}, el("b", {}, `${metricStyle("mean_error_m")[2](w.error_m)} mm`), el("span", { class: "note", style: "padding:0" }, `frame ${w.frame}${run.objects.length > 1 ? `, ${w.object}` : ""}`))))));
};

const quantile = (sorted, q) => sorted[Math.min(sorted.length - 1, Math.floor(q * sorted.length))];

const buildTiming = (runs) => {
  const stages = [["render_ms", "reading or rendering", null, "--faint"], ["vo_ms", "odometry", "odometry_ms", "--camera"], ["tracker_ms", "tracker", "tracker_ms", "--object-0"], ["mapper_ms", "mapper", "mapper_ms", "--map"]];
  const parts = runs.map((run, k) => {
    const timing = run.metrics.timing || {}, known = stages.filter(([key]) => isNumber(timing[key])), sum = known.reduce((s, [key]) => s + timing[key], 0);
    const rows = stages.map(([key, label, list, color]) => {
      const values = list ? run.timing[list].filter(isNumber).sort((a, b) => a - b) : [];
      return el("tr", {}, el("td", { class: "text" }, el("span", { class: "swatch dot", style: `color: var(${color}); margin-right: .5rem` }), label), metricCell(`${k ? "B:" : ""}timing.${key}`, key, timing[key] ?? null),
        ...(isNumber(timing[key]) && values.length ? [quantile(values, 0.5), quantile(values, 0.95), values[values.length - 1]] : [null, null, null]).map((v) => el("td", {}, v === null ? "" : shortNumber(v))));
    });
    for (const key of ["wall_s", "frames_per_s", "dropped_frames"]) {
      const [label, unit] = metricStyle(key);
      rows.push(el("tr", {}, el("td", { class: "text" }, label + (unit ? `, ${unit}` : "")), metricCell(`${k ? "B:" : ""}timing.${key}`, key, timing[key] ?? null), el("td", {}), el("td", {}), el("td", {})));
    }
    return el("div", {}, runs.length > 1 ? el("h3", {}, `Run ${"AB"[k]}`) : null,
      sum > 0 ? el("div", { class: "stack", role: "img", "aria-label": "shares of the stages" }, known.map(([key, label, , color]) => el("i", { style: `flex: ${timing[key] / sum}; background: var(${color})`, title: `${label}: ${shortNumber(timing[key])} ms` }))) : null,
      el("div", { class: "scroll" }, el("table", {}, el("thead", {}, el("tr", {}, ["ms per frame", "mean", "median", "95%", "most"].map((h) => el("th", {}, h)))), el("tbody", {}, rows))),
      el("p", { class: "note" }, `Frames are read or rendered in parallel to the stages. Memory at most: ${shortNumber(run.metrics.peak_memory_mb)} MB.`));
  });
  return section("Time", el("div", { class: "columns" }, parts));
};

const filteredTable = (kind, heads, rows, placeholder, row) => {
  const body = el("tbody", {}), input = el("input", { class: "filter", type: "search", placeholder, "aria-label": placeholder });
  const nodes = rows.map((r) => ({ node: row(r), text: JSON.stringify(r).toLowerCase() }));
  const fill = () => body.replaceChildren(...nodes.filter((n) => n.text.includes(input.value.toLowerCase())).map((n) => n.node));
  input.addEventListener("input", fill);
  fill();
  return el("div", {}, input, el("div", { class: kind, tabindex: "0" }, el("table", {}, el("thead", {}, el("tr", {}, heads.map((h) => el("th", { class: "text" }, h)))), body)));
};

const buildEvents = (run, timeline) => {
  if (!run.events.length) return section("Events", el("p", { class: "note" }, "None."));
  return section(`Events (${run.events.length})`, filteredTable("events", ["time", "source", "event", "value", "reason"], run.events, "Filter events", (e) =>
    el("tr", { onclick: () => timeline.setTime(e.t_s) }, el("td", { class: "keep" }, `${e.t_s.toFixed(2)} s`), el("td", { class: "text keep" }, e.source), el("td", { class: "text keep" }, el("span", { class: "swatch dot", style: `color: var(${EVENT_COLOR[e.event] || "--faint"}); margin-right: .45rem` }), e.event),
      el("td", {}, e.value ? shortNumber(e.value) : ""), el("td", { class: "text" }, e.reason))));
};

const buildOptions = (runs) => {
  const other = runs[1] ? new Map(runs[1].options.map(([path, value]) => [path, value])) : null;
  const heads = ["option", other ? "A" : "value", other ? "B" : "usual"];
  return section("Options", runs[0].options.length ? el("p", { class: "note" }, other ? "Bold: the two runs differ." : "Bold: not the usual value.") : el("p", { class: "note" }, "This folder has no run.yaml."),
    runs[0].options.length ? filteredTable("options", heads, runs[0].options, "Filter options", ([path, value, usual]) => {
      const beside = other ? other.get(path) ?? DASH : usual ?? "", changed = other ? beside !== value : usual !== null && usual !== value;
      return el("tr", {}, el("td", {}, path), el("td", { class: `text${changed ? " changed" : ""}` }, value), el("td", { class: "text note" }, beside === value && !other ? "" : beside));
    }) : null);
};

const setUpKeys = (timeline, toggleTheme, events) => {
  const jump = (direction) => {
    const t = timeline.times[timeline.index], times = [...new Set(events.map((e) => e.t_s))].sort((a, b) => a - b);
    const next = direction > 0 ? times.find((v) => v > t + 1e-4) : times.reverse().find((v) => v < t - 1e-4);
    if (next !== undefined) timeline.setTime(next);
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) && event.target.type !== "range") return;
    const step = event.shiftKey ? 10 : 1;
    const actions = { " ": () => timeline.toggle(), ArrowLeft: () => timeline.set(timeline.index - step), ArrowRight: () => timeline.set(timeline.index + step),
      Home: () => timeline.set(0), End: () => timeline.set(timeline.length - 1), "[": () => jump(-1), "]": () => jump(1), t: toggleTheme, T: toggleTheme, "?": () => document.getElementById("help").showModal() };
    const action = actions[event.key];
    if (!action || (event.key === " " && event.target.tagName === "BUTTON" && !event.target.classList.contains("play"))) return;
    event.preventDefault();
    action();
  });
};

const buildRunPage = (page, data, toggleTheme) => {
  const runs = data.runs, run = runs[0], timeline = new Timeline(run.t_s, run.frame);
  // The position in another run of the same frame, or of the nearest.
  const maps = runs.map((r) => {
    const other = new Timeline(r.frame, r.frame);
    return run.frame.map((f) => other.nearest(f));
  });
  const indexIn = (k, i) => (k === 0 ? i : maps[k][i] ?? 0);
  page.append(header(runs));
  for (const [k, r] of runs.entries()) page.append(runs.length > 1 ? el("h3", { class: "run-name" }, `Run ${"AB"[k]}`) : "", verdict(r), summaryTiles(r));
  let viewer = null, plots = null;
  if (timeline.length) {
    viewer = buildStage(runs, timeline, indexIn, page);
    const box = el("div", { class: "plots" });
    page.append(section("Over time", box));
    plots = buildPlots(box, runs, timeline, indexIn);
    buildTransport(run, timeline);
  }
  const names = [...new Set(runs.flatMap((r) => Object.keys(r.metrics.objects)))];
  page.append(section("Figures", el("div", { class: "columns" }, el("div", {}, el("h3", {}, "Objects"), metricTable(runs, names.map((name) => ({ head: name, part: (r) => r.metrics.objects[name], path: `objects.${name}` })))),
    el("div", {}, el("h3", {}, "Camera"), metricTable(runs, [{ head: "", part: (r) => r.metrics.camera, path: "camera" }])))));
  for (const r of runs) page.append(buildWorst(r, timeline) || "");
  page.append(buildTiming(runs), buildEvents(run, timeline), buildOptions(runs));
  page.append(section("Repeat this run", runs.map((r) => (r.command ? commandBox(r.command) : el("p", { class: "note" }, "This folder does not say how it was made.")))));
  setUpKeys(timeline, toggleTheme, run.events);
  if (timeline.length) timeline.set(0);
  return { timeline, viewer, plots };
};
