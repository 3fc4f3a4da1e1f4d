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

// A row of structure tensors.
struct TensorRow {
  std::vector<float> xx, yy, xy;
  explicit TensorRow(int width) : xx(static_cast<size_t>(width), 0.f), yy(xx), xy(xx) {}
};

void multiplyGradients(const Image<uint8_t>& image, int y, TensorRow& out) {
  const uint8_t *above = image.row(y - 1), *at = image.row(y), *below = image.row(y + 1);
  float *xx = out.xx.data(), *yy = out.yy.data(), *xy = out.xy.data();
  for (int x = 1; x + 1 < image.width; ++x) {
    const float gx = 0.5f * static_cast<float>(at[x + 1] - at[x - 1]);
    const float gy = 0.5f * static_cast<float>(below[x] - above[x]);
    xx[x] = gx * gx;
    yy[x] = gy * gy;
    xy[x] = gx * gy;
  }
}

void sumAlong(const std::vector<float>& values, std::vector<float>& sums) {
  const int end = static_cast<int>(values.size()) - kMargin;
  const float* v = values.data();
  float* s = sums.data();
  for (int x = kMargin; x < end; ++x)
    s[x] = ((v[x - 4] + v[x - 3]) + (v[x - 2] + v[x - 1])) +
           ((v[x] + v[x + 1]) + (v[x + 2] + v[x + 3]));
}

// Adds what enters a running sum and takes what leaves it; exact, since the values are quarters of
// whole numbers.
void replace(const std::vector<float>& entering, std::vector<float>& leaving,
             std::vector<float>& sum) {
  for (size_t x = 0; x < sum.size(); ++x) sum[x] += entering[x] - leaving[x];
  leaving = entering;
}

void smallestEigenvalues(const TensorRow& tensors, float* scores) {
  const float *xx = tensors.xx.data(), *yy = tensors.yy.data(), *xy = tensors.xy.data();
  constexpr float area = 4 * kWindow * kWindow;
  const int end = static_cast<int>(tensors.xx.size()) - kMargin;
  for (int x = kMargin; x < end; ++x) {
    const float difference = xx[x] - yy[x];
    scores[x] =
        0.5f / area * (xx[x] + yy[x] - std::sqrt(difference * difference + 4 * xy[x] * xy[x]));
  }
}

// Smallest eigenvalue of the structure tensor, averaged over 8 x 8 pixels, for every pixel.
Image<float> cornerScores(const Image<uint8_t>& image) {
  static_assert(kWindow == 4, "sumAlong() adds so many");
  const int w = image.width, h = image.height;
  Image<float> scores(w, h, 0.f);
  TensorRow products(w), along(w), window(w);
  std::vector<TensorRow> ring(2 * kWindow, TensorRow(w));  // the rows in the window
  for (int y = 1; y + 1 < h; ++y) {
    TensorRow& oldest = ring[static_cast<size_t>(y % (2 * kWindow))];
    multiplyGradients(image, y, products);
    for (auto part : {&TensorRow::xx, &TensorRow::yy, &TensorRow::xy}) {
      sumAlong(products.*part, along.*part);
      replace(along.*part, oldest.*part, window.*part);
    }
    const int middle = y - (kWindow - 1);
    if (middle >= kMargin && middle < h - kMargin) smallestEigenvalues(window, scores.row(middle));
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
                                  const VoOptions& options, int blurred_levels) {
  std::vector<Corner> best(grid.size());
  float penalty = 1;
  for (int l = 0; l < std::min(kLevels + blurred_levels, pyramid.levels());
       ++l, penalty *= kLevelPenalty) {
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
