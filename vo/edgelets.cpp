#include "vo/edgelets.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace diorama::vo {
namespace {

constexpr int kHalf = 4;  // of the side of the window that a patch covers, px
constexpr float kLevelPenalty =
    0.25f;  // of the next level, in pixels: its pixels are twice as wide

// Sobel's, in eighths of a grey level per pixel.
struct Gradient {
  int x = 0, y = 0;
};
Gradient gradientAt(const Image<uint8_t>& image, int x, int y) {
  const uint8_t *a = image.row(y - 1) + x, *b = image.row(y) + x, *c = image.row(y + 1) + x;
  return {a[1] + 2 * b[1] + c[1] - a[-1] - 2 * b[-1] - c[-1],
          c[-1] + 2 * c[0] + c[1] - a[-1] - 2 * a[0] - a[1]};
}

int squareOf(const Gradient& g) { return g.x * g.x + g.y * g.y; }

// Whether the image is not steeper on either side of it: else the edge is beside the pixel.
bool isOnEdge(const Image<uint8_t>& image, int x, int y, const Gradient& g) {
  // The neighbour in the gradient's direction; those at 22.5 degrees and more are diagonal ones.
  const int i = 2 * std::abs(g.x) > std::abs(g.y) ? (g.x > 0 ? 1 : -1) : 0;
  const int j = 2 * std::abs(g.y) > std::abs(g.x) ? (g.y > 0 ? 1 : -1) : 0;
  return squareOf(gradientAt(image, x + i, y + j)) <= squareOf(g) &&
         squareOf(gradientAt(image, x - i, y - j)) <= squareOf(g);
}

// Largest eigenvalue of the mean structure tensor around a pixel, (grey levels / px)^2.
float edgeScore(const Image<uint8_t>& image, int x, int y) {
  int xx = 0, yy = 0, xy = 0;
  for (int j = y - kHalf; j < y + kHalf; ++j)
    for (int i = x - kHalf; i < x + kHalf; ++i) {
      const Gradient g = gradientAt(image, i, j);
      xx += g.x * g.x;
      yy += g.y * g.y;
      xy += g.x * g.y;
    }
  const float sum = static_cast<float>(xx + yy);
  const float apart = std::hypot(static_cast<float>(xx - yy), 2 * static_cast<float>(xy));
  return 0.5f * (sum + apart) / (64 * 4 * kHalf * kHalf);
}

struct Steepest {
  int square = 0, x = 0, y = 0;
};

// In each free cell.
std::vector<Steepest> steepestOf(const Image<uint8_t>& image, int level, const CellGrid& grid,
                                 const std::vector<uint8_t>& occupied) {
  std::vector<Steepest> steepest(grid.size());
  for (int y = kCornerMargin; y < image.height - kCornerMargin; ++y)
    for (int x = kCornerMargin; x < image.width - kCornerMargin; ++x) {
      const size_t cell = grid.cellOf(fromLevel(Vector2d(x, y), level));
      if (occupied[cell]) continue;
      const Gradient g = gradientAt(image, x, y);
      if (squareOf(g) > steepest[cell].square && isOnEdge(image, x, y, g))
        steepest[cell] = {squareOf(g), x, y};
    }
  return steepest;
}

}  // namespace

std::vector<Corner> detectEdgelets(const ImagePyramid& pyramid, double noise, const CellGrid& grid,
                                   const std::vector<uint8_t>& occupied, int count,
                                   const VoOptions& options, int blurred_levels) {
  std::vector<Corner> best(grid.size());
  float penalty = 1;
  for (int l = 0; l < std::min(kCornerLevels + blurred_levels, pyramid.levels());
       ++l, penalty *= kLevelPenalty) {
    const float threshold = leastScore(options.min_edge_score, noise, l, options);
    const std::vector<Steepest> steepest = steepestOf(pyramid.level(l), l, grid, occupied);
    for (size_t cell = 0; cell < steepest.size(); ++cell) {
      const Steepest& at = steepest[cell];
      if (at.square == 0) continue;
      const float score = edgeScore(pyramid.level(l), at.x, at.y);
      if (score >= threshold && score * penalty > best[cell].score)
        best[cell] = {fromLevel(Vector2d(at.x, at.y), l), l, score * penalty};
    }
  }
  return strongest(std::move(best), count);
}

}  // namespace diorama::vo
