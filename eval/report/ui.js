// Elements, numbers and colours. Text from the data becomes text nodes, never markup.
const el = (tag, attributes = {}, ...children) => {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else if (name === "style") node.style.cssText = value;
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.flat().filter((c) => c !== null && c !== undefined && c !== false));
  return node;
};

const cssColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const objectColor = (k) => cssColor(`--object-${k % 5}`);

const isNumber = (v) => typeof v === "number" && Number.isFinite(v);
const DASH = "–";

// Three significant places, at least as many decimals as a quick eye needs.
const shortNumber = (v) => {
  if (!isNumber(v)) return DASH;
  const size = Math.abs(v);
  const decimals = size >= 100 || size === 0 ? 0 : size >= 10 ? 1 : size >= 0.095 ? 2 : 3;
  return v.toFixed(decimals).replace("-", "−");
};
const percent = (v) => {
  if (!isNumber(v)) return DASH;
  const p = 100 * v;
  return p === 0 || p === 100 ? p.toFixed(0) : p > 99.95 ? "99.9" : p.toFixed(1);
};
const wholeNumber = (v) => (isNumber(v) ? String(v) : DASH);
const DEGREES = 180 / Math.PI;

// How a metric is shown: [label, unit, text of a value, which way is better].
const METRICS = {
  ate_mean_m: ["position error (ATE), mean", "mm", (v) => shortNumber(1e3 * v), -1],
  ate_std_m: ["position error, standard deviation", "mm", (v) => shortNumber(1e3 * v), -1],
  ate_median_m: ["position error, median", "mm", (v) => shortNumber(1e3 * v), -1],
  ate_rmse_m: ["position error, root mean square", "mm", (v) => shortNumber(1e3 * v), -1],
  rpe_trans_rmse_m: ["frame to frame (RPE)", "mm", (v) => shortNumber(1e3 * v), -1],
  rpe_rot_rmse_rad: ["frame to frame, rotation", "°", (v) => shortNumber(DEGREES * v), -1],
  sim3_scale: ["scale against truth", "", (v) => (isNumber(v) ? v.toFixed(4) : DASH), 0],
  tracked_ratio: ["frames with healthy odometry", "%", percent, 1],
  odometry_nees: ["odometry consistency (NEES, 6 is right)", "", shortNumber, 0],
  mean_error_m: ["position error, mean", "mm", (v) => shortNumber(1e3 * v), -1],
  std_error_m: ["position error, standard deviation", "mm", (v) => shortNumber(1e3 * v), -1],
  median_error_m: ["position error, median", "mm", (v) => shortNumber(1e3 * v), -1],
  mean_error_rad: ["rotation error, mean", "°", (v) => shortNumber(DEGREES * v), -1],
  ratio_below_0_5_m: ["frames below 0.5 m", "%", percent, 1],
  success_5cm_5deg: ["within 5 cm and 5°", "%", percent, 1],
  success_1cm_1deg: ["within 1 cm and 1°", "%", percent, 1],
  success_visible_5cm_5deg: ["within 5 cm and 5°, where 40% is seen", "%", percent, 1],
  success_visible_1cm_1deg: ["within 1 cm and 1°, where 40% is seen", "%", percent, 1],
  add_auc_10cm: ["ADD AUC up to 10 cm", "%", percent, 1],
  reported_ratio: ["frames with an estimate", "%", percent, 1],
  claimed_ratio: ["frames claimed by the tracker", "%", percent, 1],
  false_claim_ratio: ["false claims", "%", percent, -1],
  tracker_nees: ["tracker consistency (NEES, 6 is right)", "", shortNumber, 0],
  reinitialisations: ["re-initialisations", "", wholeNumber, -1],
  map_error_m: ["final map, position error", "mm", (v) => shortNumber(1e3 * v), -1],
  map_error_rad: ["final map, rotation error", "°", (v) => shortNumber(DEGREES * v), -1],
  map_nees: ["final map, consistency (NEES)", "", shortNumber, 0],
  wall_s: ["whole run", "s", shortNumber, -1],
  frames_per_s: ["frames per second", "", shortNumber, 1],
  render_ms: ["reading or rendering", "ms", shortNumber, -1],
  vo_ms: ["odometry", "ms", shortNumber, -1],
  tracker_ms: ["tracker", "ms", shortNumber, -1],
  mapper_ms: ["mapper", "ms", shortNumber, -1],
  dropped_frames: ["dropped frames", "", wholeNumber, -1],
};
const metricStyle = (key) => {
  const [label, unit, text, better] = METRICS[key] || [key.replaceAll("_", " "), "", shortNumber, 0];
  return [label, unit, (v) => (isNumber(v) ? text(v) : DASH), better];
};

const section = (title, ...children) => el("section", {}, el("h2", {}, title), ...children);

// A button that copies a text, with the text.
const commandBox = (text) => {
  const button = el("button", { type: "button" }, "Copy");
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = "Copied";
    } catch {
      getSelection().selectAllChildren(button.previousSibling);
      button.textContent = "Selected";
    }
    setTimeout(() => (button.textContent = "Copy"), 1500);
  });
  return el("div", { class: "card command" }, el("code", {}, text), button);
};

const themeListeners = [];
const setUpTheme = () => {
  const root = document.documentElement;
  const dark = () =>
    (root.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
  const apply = (theme) => {
    root.dataset.theme = theme;
    document.getElementById("theme-button").textContent = theme === "dark" ? "Light" : "Dark";
    for (const f of themeListeners) f();
  };
  const toggle = () => {
    const theme = dark() ? "light" : "dark";
    apply(theme);
    try { localStorage.setItem("diorama-theme", theme); } catch { /* a page from disk may have no storage */ }
  };
  let kept = null;
  try { kept = localStorage.getItem("diorama-theme"); } catch { /* the same */ }
  if (kept === "light" || kept === "dark") root.dataset.theme = kept;
  document.getElementById("theme-button").textContent = dark() ? "Light" : "Dark";
  document.getElementById("theme-button").addEventListener("click", toggle);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => themeListeners.forEach((f) => f()));
  return toggle;
};
