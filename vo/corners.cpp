#include "vo/corners.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kLevels = 3;  // coarser corners are located too badly
constexpr int kWindow = 4;  // half a side of the window that is averaged over, px
constexpr int kMargin = 7;  // px of the level: a patch with its border fits
constexpr float kLevelPenalty =
    0.75f;  // a corner of the next level is located half as well, but often more stable

// Of whole numbers: running sums stay exact. Gradients count in eighths of a grey level per pixel.
constexpr float kUnit = 1.f / 8;

// A row of structure tensors.
struct TensorRow {
  std::vector<int> xx, yy, xy;
  explicit TensorRow(int width) : xx(static_cast<size_t>(width), 0), yy(xx), xy(xx) {}
};

// Sobel's gradients: across them they smooth the steps of outlines that are drawn without
// smoothing, which are no corners.
void multiplyGradients(const Image<uint8_t>& image, int y, TensorRow& out) {
  const uint8_t *above = image.row(y - 1), *at = image.row(y), *below = image.row(y + 1);
  // Not one of them overlaps with another: the loop is done in vectors.
  int* __restrict xx = out.xx.data(), * __restrict yy = out.yy.data(), * __restrict xy = out.xy.data();
  for (int x = 1; x + 1 < image.width; ++x) {
    const int left = above[x - 1] + 2 * at[x - 1] + below[x - 1];
    const int right = above[x + 1] + 2 * at[x + 1] + below[x + 1];
    const int top = above[x - 1] + 2 * above[x] + above[x + 1];
    const int bottom = below[x - 1] + 2 * below[x] + below[x + 1];
    const int gx = right - left, gy = bottom - top;
    xx[x] = gx * gx;
    yy[x] = gy * gy;
    xy[x] = gx * gy;
  }
}

void sumAlong(const std::vector<int>& values, std::vector<int>& sums) {
  const int end = static_cast<int>(values.size()) - kMargin;
  const int* v = values.data();
  int* s = sums.data();
  for (int x = kMargin; x < end; ++x)
    s[x] = ((v[x - 4] + v[x - 3]) + (v[x - 2] + v[x - 1])) +
           ((v[x] + v[x + 1]) + (v[x + 2] + v[x + 3]));
}

// Adds what enters a running sum and takes what leaves it.
void replace(const std::vector<int>& entering, std::vector<int>& leaving, std::vector<int>& sum) {
  for (size_t x = 0; x < sum.size(); ++x) sum[x] += entering[x] - leaving[x];
  leaving = entering;
}

// 0 where the largest eigenvalue is too much larger.
void smallestEigenvalues(const TensorRow& tensors, float least_ratio, float* scores) {
  constexpr float kScale = 0.5f / (4 * kWindow * kWindow) * kUnit * kUnit;
  using Row = Eigen::ArrayXf;
  const Eigen::Index n = static_cast<Eigen::Index>(tensors.xx.size()) - 2 * kMargin;
  const auto valuesOf = [&](const std::vector<int>& values) {
    return Eigen::Map<const Eigen::ArrayXi>(values.data() + kMargin, n).cast<float>();
  };
  const Row xx = valuesOf(tensors.xx), yy = valuesOf(tensors.yy), xy = valuesOf(tensors.xy);
  const Row sum = xx + yy, apart = ((xx - yy).square() + 4 * xy.square()).sqrt();
  Eigen::Map<Row>(scores + kMargin, n) =
      (sum - apart >= least_ratio * (sum + apart)).select(kScale * (sum - apart), 0.f);
}

// Smallest eigenvalue of the structure tensor, averaged over 8 x 8 pixels, for every pixel.
Image<float> cornerScores(const Image<uint8_t>& image, float least_ratio) {
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
    if (middle >= kMargin && middle < h - kMargin)
      smallestEigenvalues(window, least_ratio, scores.row(middle));
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
    const Image<float> scores =
        cornerScores(pyramid.level(l), static_cast<float>(options.min_corner_ratio));
    // A gradient has 3/16 of the noise's variance; halving the image halves sigma.
    const double noise_score = 3.0 / 16 * noise * noise / (1 << (2 * l));
    const float threshold =
        static_cast<float>(options.min_corner_score + options.corner_noise_factor * noise_score);
    for (int y = kMargin; y < scores.height - kMargin; ++y) {
      const float* row = scores.row(y);
      for (int x = kMargin; x < scores.width - kMargin; ++x) {
        const float score = row[x];
        if (score < threshold || score < row[x - 1] || score < row[x + 1]) continue;
        const Vector2d u_px = fromLevel(Vector2d(x, y), l);
        const size_t cell = grid.cellOf(u_px);
        if (occupied[cell] || score * penalty <= best[cell].score) continue;
        if (isLocalMaximum(scores, x, y)) best[cell] = {u_px, l, score * penalty};
      }
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
