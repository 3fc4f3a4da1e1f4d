// Curves of error over time, one panel per sequence, what could be seen of the object shaded
// beneath (the paper's Figure 4), as one SVG picture.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace diorama {

struct ErrorCurve {
  std::string name;  // the same name has the same colour in all panels
  std::vector<std::optional<double>> error_m;
};

struct ErrorPanel {
  std::string title;
  std::vector<double> times_s;  // one per value of each list below
  std::vector<ErrorCurve> curves;
  std::vector<std::optional<double>> visible_fraction;
};

// Logarithmic, 0.1 mm to 1 m; the picture follows a page's light or dark mode.
std::string errorFigure(const std::vector<ErrorPanel>& panels);

}  // namespace diorama
