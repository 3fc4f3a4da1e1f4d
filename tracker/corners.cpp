#include "tracker/corners.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr int kCell = 8;         // px
constexpr int kRadius = 2;       // px, of the structure tensor
constexpr float kWeakest = 400;  // smaller eigenvalue of a corner, grey levels^2 over the window

float cornerStrength(const Image<uint8_t>& image, int x, int y) {
  int xx = 0, xy = 0, yy = 0;  // of twice the gradient
  for (int j = y - kRadius; j <= y + kRadius; ++j) {
    const uint8_t *above = image.row(j - 1), *row = image.row(j), *below = image.row(j + 1);
    for (int i = x - kRadius; i <= x + kRadius; ++i) {
      const int gx = row[i + 1] - row[i - 1], gy = below[i] - above[i];
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const float half = 0.125f * static_cast<float>(xx + yy);
  const float difference = 0.125f * static_cast<float>(xx - yy);
  const float mixed = 0.25f * static_cast<float>(xy);
  return half - std::sqrt(difference * difference + mixed * mixed);
}

}  // namespace

std::vector<Vector2d> findCorners(const Image<uint8_t>& image, const Vector2d& low,
                                  const Vector2d& high, int border) {
  struct Corner {
    float strength;
    int x, y;
  };
  const auto clamped = [&](double u, int size) {
    return static_cast<int>(std::clamp(u, static_cast<double>(border), size - 1.0 - border));
  };
  std::vector<Corner> corners;
  if (image.width <= 2 * border || image.height <= 2 * border) return {};
  const int x0 = clamped(low.x(), image.width), x1 = clamped(high.x(), image.width);
  const int y0 = clamped(low.y(), image.height), y1 = clamped(high.y(), image.height);
  for (int cell_y = y0; cell_y <= y1; cell_y += kCell)
    for (int cell_x = x0; cell_x <= x1; cell_x += kCell) {
      // The windows of every fourth pixel see all of the cell; then the neighbours of the best.
      Corner best{kWeakest, -1, -1};
      const auto consider = [&](int x, int y) {
        if (x < x0 || y < y0 || x > x1 || y > y1) return;
        if (const float s = cornerStrength(image, x, y); s > best.strength) best = {s, x, y};
      };
      for (int y = cell_y + 1; y < cell_y + kCell; y += 4)
        for (int x = cell_x + 1; x < cell_x + kCell; x += 4) consider(x, y);
      if (best.x < 0) continue;
      const Corner coarse = best;
      for (int y = coarse.y - 1; y <= coarse.y + 1; ++y)
        for (int x = coarse.x - 1; x <= coarse.x + 1; ++x) consider(x, y);
      corners.push_back(best);
    }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.strength > b.strength; });
  std::vector<Vector2d> out;
  out.reserve(corners.size());
  for (const Corner& c : corners) out.emplace_back(c.x, c.y);
  return out;
}

}  // namespace diorama
