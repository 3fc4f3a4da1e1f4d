"""What the monitor shows: an editor, two plots and a terminal."""

import math

from .canvas import Canvas, linear
from .noise import rng

CODE = """// Tracks one object in one frame.
TrackResult ObjectTracker::track(const Frame& frame) {
  const Gradient image = gradient(frame.image);
  State best = prediction_;
  for (int level = levels() - 1; level >= 0; --level) {
    const auto edges = salientEdges(best, level);
    if (edges.size() < options_.min_edges) {
      return lost("too few edges");
    }
    for (int i = 0; i < options_.iterations; ++i) {
      NormalEquations system;
      for (const Edge& e : edges) {
        const auto hit = search(image, e, best);
        if (!hit) continue;
        const double r = hit->distance_px;
        system.add(jacobian(e, best), r, tukey(r));
      }
      best = best * Exp(system.solve());
    }
  }
  return {best, covariance(best), Health::kGood};
}"""
WORDS = {"const", "for", "if", "return", "int", "double", "auto", "continue"}


def code(c, x, y, size):
    for k, line in enumerate(CODE.split("\n")):
        yy = y + k * size * 1.42
        c.text(x - 6, yy, str(118 + k), size * 0.9, "mono", "#5a6572", "r")
        cx = x
        if line.strip().startswith("//"):
            c.text(cx, yy, line, size, "mono", "#6f9a62")
            continue
        for part in line.replace("(", " ( ").replace(")", " ) ").split(" "):
            tone = "#c586c0" if part in WORDS else "#4ec9b0" if part[:1].isupper() else \
                "#ce9178" if part.startswith('"') else \
                "#d4c08a" if part.endswith("_") else "#c9d1d9"
            c.text(cx, yy, part, size, "mono", tone)
            cx += size * 0.602 * (len(part) + (part not in ("(", ")")))


def plot(c, x, y, w, h, title, curves, seed):
    random = rng(seed)
    c.rect(x, y, w, h, "#f4f5f6")
    c.text(x + w / 2, y + 13, title, 9, "medium", "#222222", "c")
    for k in range(6):
        c.line(x + 26, y + 22 + (h - 42) * k / 5, x + w - 8, y + 22 + (h - 42) * k / 5, "#d5d9dd",
               0.6)
        c.text(x + 23, y + 25 + (h - 42) * k / 5, f"{(5 - k) * 4}", 6.5, "sans", "#444444", "r")
        c.text(x + 26 + (w - 34) * k / 5, y + h - 9, f"{k * 6}", 6.5, "sans", "#444444", "c")
    for k, tone in enumerate(curves):
        pts, v = [], 0.25 + 0.2 * k
        for i in range(90):
            v += random.normal(0, 0.025) + 0.01 * math.sin(i / 9 + 2 * k)
            v = min(max(v, 0.05), 0.95)
            pts.append((x + 26 + (w - 34) * i / 89, y + h - 20 - (h - 42) * v))
        c.poly(pts, None, tone, 1.5, closed=False)
    c.rect(x + 26, y + 22, w - 34, h - 42, None, "#555b61", 0.8)


def screen():
    c = Canvas(800, 450, 1024, 512, "#1b1f24")
    c.rect(0, 0, 800, 17, "#30363d")
    c.text(10, 12, "diorama — tracker/object_tracker.cpp", 9, "medium", "#c9d1d9")
    for k, tone in enumerate(("#d9694f", "#dbb04a", "#67a65a")):
        c.circle(756 + 15 * k, 8.5, 4.5, tone)
    c.rect(0, 17, 96, 420, "#22272e")
    names = ("core", "sim", "tracker", "  edges.cpp", "  edges.h", "  object_tracker.cpp",
             "  object_tracker.h", "  particle.cpp", "vo", "  depth_filter.cpp", "  odometry.cpp",
             "mapper", "  gating.cpp", "  mapper.cpp", "  smoother.cpp", "eval", "app", "docs",
             "tests")
    for k, name in enumerate(names):
        if k == 5:
            c.rect(0, 25 + 14 * k, 96, 14, "#37414d")
        c.text(10, 35 + 14 * k, name, 8.2, "medium" if name[0] != " " else "sans", "#b5bec8")
    code(c, 126, 36, 9.4)
    c.rect(100, 322, 398, 115, "#14171b")
    lines = ("$ diorama run scenes/orange_juice.yaml -o out",
             "frame  300/900  tracked 1/1  17.2 ms", "frame  600/900  tracked 1/1  16.8 ms",
             "frame  900/900  tracked 1/1  17.0 ms", "mean error 0.0061 m   success 98.4 %",
             "loop closed at 28.4 s, drift 0.4 %", "$ _")
    for k, line in enumerate(lines):
        c.text(108, 337 + 14.6 * k, line, 9.4, "mono", "#8fd08a" if k in (0, 6) else "#c9d1d9")
    plot(c, 504, 22, 290, 130, "translation error [mm]", ("#c8452e", "#2a6f9e", "#4d8a3f"), 1101)
    plot(c, 504, 158, 290, 130, "visible fraction, residual [px]", ("#8d5aa5", "#d9902a"), 1102)
    c.rect(504, 294, 290, 143, linear(504, 294, 794, 437, (0, "#30414d"), (1, "#77573c")))
    c.poly([(560, 400), (630, 418), (744, 396), (676, 380)], "#b08a5e")
    c.poly([(610, 330), (650, 338), (650, 402), (610, 392)], "#e7a13f", "#57d977", 1.4)
    c.poly([(650, 338), (684, 328), (684, 390), (650, 402)], "#d9c9a5", "#57d977", 1.4)
    c.poly([(610, 330), (630, 312), (668, 310), (650, 338)], "#efb75a", "#57d977", 1.4)
    c.text(514, 308, "frame 412  ·  1 object", 8.5, "mono", "#d5efe0")
    c.rect(0, 437, 800, 13, "#2a5f7e")
    c.text(10, 446.5, "main   0 errors   C++20   UTF-8   Ln 131, Col 24", 8.2, "sans", "#e3edf3")
    return c.image()
