#include "eval/error_figure.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"
#include "eval/report_page.h"

namespace diorama {
namespace {

constexpr double kPanelWidth = 520, kPanelHeight = 210, kLeft = 50, kRight = 14, kTop = 30,
                 kBottom = 26;
constexpr double kLow_m = 1e-4, kHigh_m = 1;
constexpr int kMaxPoints = 600;  // of a curve: there are no more columns of pixels

std::string number(double v) { return formatFixed(v, 1); }

// Places on the picture of one panel.
struct Axes {
  double x0, y0, first_s, last_s;
  double x(double t_s) const {
    const double span = std::max(1e-9, last_s - first_s);
    return x0 + kLeft + (t_s - first_s) / span * (kPanelWidth - kLeft - kRight);
  }
  double share(double fraction) const {  // 0 at the bottom, 1 at the top
    return y0 + kPanelHeight - kBottom - fraction * (kPanelHeight - kTop - kBottom);
  }
  double y(double error_m) const {
    const double clamped = std::clamp(error_m, kLow_m, kHigh_m);
    return share(std::log(clamped / kLow_m) / std::log(kHigh_m / kLow_m));
  }
};

std::string text(double x, double y, const std::string& content, const char* style) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" class=\"" + style + "\">" +
         htmlEscaped(content) + "</text>\n";
}

std::string grid(const Axes& axes) {
  std::string svg;
  for (const auto& [value, label] :
       {std::pair(1e-4, "0.1 mm"), {1e-3, "1 mm"}, {1e-2, "1 cm"}, {1e-1, "10 cm"}, {1.0, "1 m"}}) {
    const std::string y = number(axes.y(value));
    svg += "<line x1=\"" + number(axes.x(axes.first_s)) + "\" x2=\"" + number(axes.x(axes.last_s)) +
           "\" y1=\"" + y + "\" y2=\"" + y + "\" class=\"grid\"/>\n";
    svg += text(axes.x0 + kLeft - 6, axes.y(value) + 3.5, label, "axis end");
  }
  const double step = axes.last_s - axes.first_s > 12 ? 5 : 1;
  for (double t = std::ceil(axes.first_s / step) * step; t <= axes.last_s + 1e-6; t += step)
    svg += text(axes.x(t), axes.y0 + kPanelHeight - 9, formatFixed(t, 0) + " s", "axis middle");
  return svg;
}

std::string visibleArea(const Axes& axes, const ErrorPanel& panel, size_t step) {
  std::string path;
  for (size_t i = 0; i < panel.times_s.size(); i += step) {
    const double visible = panel.visible_fraction[i].value_or(0);
    path +=
        (path.empty() ? "M" + number(axes.x(panel.times_s[i])) + " " + number(axes.share(0)) + "L"
                      : "L") +
        number(axes.x(panel.times_s[i])) + " " + number(axes.share(visible));
  }
  if (path.empty()) return "";
  return "<path class=\"seen\" d=\"" + path + "L" + number(axes.x(axes.last_s)) + " " +
         number(axes.share(0)) + "Z\"/>\n";
}

// The greatest error of each step, so that no peak is lost.
std::string curvePath(const Axes& axes, const ErrorPanel& panel, const ErrorCurve& curve,
                      size_t step) {
  std::string path;
  bool pen_down = false;
  for (size_t i = 0; i < panel.times_s.size(); i += step) {
    std::optional<double> worst;
    for (size_t k = i; k < std::min(i + step, panel.times_s.size()); ++k)
      if (curve.error_m[k]) worst = std::max(worst.value_or(0), *curve.error_m[k]);
    if (worst)
      path +=
          (pen_down ? "L" : "M") + number(axes.x(panel.times_s[i])) + " " + number(axes.y(*worst));
    pen_down = worst.has_value();
  }
  return path;
}

std::string drawPanel(const ErrorPanel& panel, double x0, double y0) {
  std::string svg = text(x0 + kLeft, y0 + 18, panel.title, "title");
  if (panel.times_s.empty()) return svg;
  const Axes axes{x0, y0, panel.times_s.front(), panel.times_s.back()};
  const size_t step = (panel.times_s.size() + kMaxPoints - 1) / kMaxPoints;
  if (!panel.visible_fraction.empty()) svg += visibleArea(axes, panel, step);
  svg += grid(axes);
  for (size_t c = 0; c < panel.curves.size(); ++c)
    svg += "<path class=\"curve c" + std::to_string(c) + "\" d=\"" +
           curvePath(axes, panel, panel.curves[c], step) + "\"/>\n";
  return svg;
}

// Colours as in the report: odometry blue, tracker amber, both together green.
constexpr const char* kStyle = R"(<style>
.figure { --ink: #1b1c1e; --soft: #5d6168; --rule: #e4e5e7; --seen: #e9eef4; --c0: #2463c4; --c1: #b87400; --c2: #15893c; }
@media (prefers-color-scheme: dark) { :root:not([data-theme="light"]) .figure { --ink: #eceded; --soft: #a3a8b0; --rule: #2c2f34; --seen: #23303d; --c0: #79a9ff; --c1: #ffbe3c; --c2: #4be069; } }
:root[data-theme="dark"] .figure { --ink: #eceded; --soft: #a3a8b0; --rule: #2c2f34; --seen: #23303d; --c0: #79a9ff; --c1: #ffbe3c; --c2: #4be069; }
.figure text { font: 11px system-ui, "Liberation Sans", Arial, sans-serif; fill: var(--soft); }
.figure .title { font-size: 13px; font-weight: 600; fill: var(--ink); }
.figure .end { text-anchor: end; } .figure .middle { text-anchor: middle; }
.figure .grid { stroke: var(--rule); } .figure .seen { fill: var(--seen); }
.figure .curve { fill: none; stroke-width: 1.3; stroke-linejoin: round; }
.figure .c0 { stroke: var(--c0); } .figure .c1 { stroke: var(--c1); } .figure .c2 { stroke: var(--c2); }
</style>
)";

}  // namespace

std::string errorFigure(const std::vector<ErrorPanel>& panels) {
  const int columns = panels.size() > 1 ? 2 : 1;
  const auto rows =
      (panels.size() + static_cast<size_t>(columns) - 1) / static_cast<size_t>(columns);
  const double width = columns * kPanelWidth;
  const double height = 26 + static_cast<double>(rows) * kPanelHeight;
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"figure\" viewBox=\"0 0 " +
                    number(width) + " " + number(height) + "\">\n" + kStyle;
  double x = kLeft;
  if (!panels.empty())
    for (size_t c = 0; c < panels[0].curves.size(); ++c) {
      svg += "<line x1=\"" + number(x) + "\" x2=\"" + number(x + 18) +
             "\" y1=\"12\" y2=\"12\" class=\"curve c" + std::to_string(c) + "\"/>\n";
      svg += text(x + 24, 16, panels[0].curves[c].name, "");
      x += 40 + 7 * static_cast<double>(panels[0].curves[c].name.size());
    }
  svg += "<rect x=\"" + number(x) + "\" y=\"6\" width=\"18\" height=\"12\" class=\"seen\"/>\n" +
         text(x + 24, 16, "seen of the object", "");
  for (size_t i = 0; i < panels.size(); ++i)
    svg += drawPanel(panels[i], static_cast<double>(i % static_cast<size_t>(columns)) * kPanelWidth,
                     26 + static_cast<double>(i / static_cast<size_t>(columns)) * kPanelHeight);
  return svg + "</svg>\n";
}

}  // namespace diorama
