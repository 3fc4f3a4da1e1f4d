#include "vo/corners.h"

#include <algorithm>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kLevels = 3;  // coarser corners are located too badly
constexpr int kWindow = 4;  // half a side of the window that is averaged over, px
constexpr int kMargin = 7;  // px of the level: a patch with its border fits
constexpr float kLevelPenalty =
    0.75f;  // a corner of the next level is located half as well, but often more stable

// Smallest eigenvalue of the structure tensor, averaged over 8 x 8 pixels, for every pixel.
Image<float> cornerScores(const Image<uint8_t>& image) {
  const int w = image.width, h = image.height;
  Image<float> scores(w, h, 0.f);
  struct Tensor {
    float xx = 0, yy = 0, xy = 0;
  };
  Image<Tensor> rows(w, h);  // sums along x
  std::vector<Tensor> line(static_cast<size_t>(w));
  for (int y = 1; y + 1 < h; ++y) {
    const uint8_t *above = image.row(y - 1), *at = image.row(y), *below = image.row(y + 1);
    for (int x = 1; x + 1 < w; ++x) {
      const float gx = 0.5f * static_cast<float>(at[x + 1] - at[x - 1]);
      const float gy = 0.5f * static_cast<float>(below[x] - above[x]);
      line[static_cast<size_t>(x)] = {gx * gx, gy * gy, gx * gy};
    }
    for (int x = kMargin; x < w - kMargin; ++x) {
      Tensor sum;
      for (int i = -kWindow; i < kWindow; ++i) {
        const Tensor& t = line[static_cast<size_t>(x + i)];
        sum = {sum.xx + t.xx, sum.yy + t.yy, sum.xy + t.xy};
      }
      rows(x, y) = sum;
    }
  }
  std::vector<Tensor> column(static_cast<size_t>(w));
  constexpr float area = 4 * kWindow * kWindow;
  for (int y = kWindow + 1; y < h - kWindow; ++y) {
    std::fill(column.begin(), column.end(), Tensor{});
    for (int j = -kWindow; j < kWindow; ++j)
      for (int x = kMargin; x < w - kMargin; ++x) {
        Tensor& sum = column[static_cast<size_t>(x)];
        const Tensor& t = rows(x, y + j);
        sum = {sum.xx + t.xx, sum.yy + t.yy, sum.xy + t.xy};
      }
    if (y < kMargin || y >= h - kMargin) continue;
    for (int x = kMargin; x < w - kMargin; ++x) {
      const Tensor& t = column[static_cast<size_t>(x)];
      const float difference = t.xx - t.yy;
      scores(x, y) =
          0.5f / area * (t.xx + t.yy - std::sqrt(difference * difference + 4 * t.xy * t.xy));
    }
  }
  return scores;
}

bool isLocalMaximum(const Image<float>& scores, int x, int y) {
  const float s = scores(x, y);
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i)
      if (scores(x + i, y + j) > s) return false;
  return true;
}

}  // namespace

std::vector<Corner> detectCorners(const ImagePyramid& pyramid, double noise, const CellGrid& grid,
                                  const std::vector<uint8_t>& occupied, int count,
                                  const VoOptions& options) {
  std::vector<Corner> best(grid.size());
  float penalty = 1;
  for (int l = 0; l < std::min(kLevels, pyramid.levels()); ++l, penalty *= kLevelPenalty) {
    const Image<float> scores = cornerScores(pyramid.level(l));
    // A difference over two pixels of noise has half its variance; halving the image halves sigma.
    const double noise_score = 0.5 * noise * noise / (1 << (2 * l));
    const float threshold =
        static_cast<float>(options.min_corner_score + options.corner_noise_factor * noise_score);
    for (int y = kMargin; y < scores.height - kMargin; ++y)
      for (int x = kMargin; x < scores.width - kMargin; ++x) {
        const float score = scores(x, y);
        if (score < threshold) continue;
        const Vector2d u_px = fromLevel(Vector2d(x, y), l);
        const size_t cell = grid.cellOf(u_px);
        if (occupied[cell] || score * penalty <= best[cell].score) continue;
        if (isLocalMaximum(scores, x, y)) best[cell] = {u_px, l, score * penalty};
      }
  }
  std::erase_if(best, [](const Corner& c) { return c.score <= 0; });
  std::stable_sort(best.begin(), best.end(),
                   [](const Corner& a, const Corner& b) { return a.score > b.score; });
  if (best.size() > static_cast<size_t>(std::max(count, 0)))
    best.resize(static_cast<size_t>(std::max(count, 0)));
  return best;
}

}  // namespace diorama::vo
