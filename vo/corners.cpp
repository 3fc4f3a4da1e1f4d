#include "vo/corners.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

namespace diorama::vo {
namespace {

constexpr int kWindow = 4;  // half a side of the window that is averaged over, px
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
// None of the rows overlaps with another: the loop is done in vectors.
void multiplyGradients(const uint8_t* __restrict above, const uint8_t* __restrict at,
                       const uint8_t* __restrict below, int width, int* __restrict xx,
                       int* __restrict yy, int* __restrict xy) {
  for (int x = 1; x + 1 < width; ++x) {
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

// Sums over the window's width: what enters a running sum of rows, in place of the oldest row.
void moveWindow(const int* __restrict v, int width, int* __restrict oldest, int* __restrict sum) {
  for (int x = kCornerMargin; x < width - kCornerMargin; ++x) {
    const int entering = ((v[x - 4] + v[x - 3]) + (v[x - 2] + v[x - 1])) +
                         ((v[x] + v[x + 1]) + (v[x + 2] + v[x + 3]));
    sum[x] += entering - oldest[x];
    oldest[x] = entering;
  }
}

// values[i] becomes 0 where least[i] is above at[i].
void dropBelow(const float* __restrict at, const float* __restrict least, Eigen::Index n,
               float* __restrict values) {
  for (Eigen::Index i = 0; i < n; ++i) {
    const float value = values[i];
    values[i] = at[i] >= least[i] ? value : 0.f;
  }
}

// 0 where the largest eigenvalue is too much larger.
void smallestEigenvalues(const TensorRow& tensors, float least_ratio, float* scores) {
  constexpr float kScale = 0.5f / (4 * kWindow * kWindow) * kUnit * kUnit;
  using Row = Eigen::ArrayXf;
  const Eigen::Index n = static_cast<Eigen::Index>(tensors.xx.size()) - 2 * kCornerMargin;
  const auto valuesOf = [&](const std::vector<int>& values) {
    return Eigen::Map<const Eigen::ArrayXi>(values.data() + kCornerMargin, n).cast<float>();
  };
  const Row xx = valuesOf(tensors.xx), yy = valuesOf(tensors.yy), xy = valuesOf(tensors.xy);
  const Row sum = xx + yy, apart = ((xx - yy).square() + 4 * xy.square()).sqrt();
  const Row smallest = sum - apart, least = least_ratio * (sum + apart);
  Eigen::Map<Row>(scores + kCornerMargin, n) = kScale * smallest;
  dropBelow(smallest.data(), least.data(), n, scores + kCornerMargin);
}

// Smallest eigenvalue of the structure tensor, averaged over 8 x 8 pixels, for every pixel.
Image<float> cornerScores(const Image<uint8_t>& image, float least_ratio) {
  static_assert(kWindow == 4, "moveWindow() adds so many");
  const int w = image.width, h = image.height;
  Image<float> scores(w, h, 0.f);
  TensorRow products(w), window(w);
  std::vector<TensorRow> ring(2 * kWindow, TensorRow(w));  // the rows in the window
  for (int y = 1; y + 1 < h; ++y) {
    TensorRow& oldest = ring[static_cast<size_t>(y % (2 * kWindow))];
    multiplyGradients(image.row(y - 1), image.row(y), image.row(y + 1), w, products.xx.data(),
                      products.yy.data(), products.xy.data());
    for (auto part : {&TensorRow::xx, &TensorRow::yy, &TensorRow::xy})
      moveWindow((products.*part).data(), w, (oldest.*part).data(), (window.*part).data());
    const int middle = y - (kWindow - 1);
    if (middle >= kCornerMargin && middle < h - kCornerMargin)
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

float leastScore(double least, double noise, int level, const VoOptions& options) {
  // A gradient has 3/16 of the noise's variance; halving the image halves sigma.
  const double noise_score = 3.0 / 16 * noise * noise / (1 << (2 * level));
  return static_cast<float>(least + options.corner_noise_factor * noise_score);
}

std::vector<Corner> strongest(std::vector<Corner> corners, int count) {
  std::erase_if(corners, [](const Corner& c) { return c.score <= 0; });
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.score > b.score; });
  const size_t most = static_cast<size_t>(std::max(count, 0));
  if (corners.size() > most) corners.resize(most);
  return corners;
}

std::vector<Corner> detectCorners(const ImagePyramid& pyramid, double noise, const CellGrid& grid,
                                  const std::vector<uint8_t>& occupied, int count,
                                  const VoOptions& options, int blurred_levels) {
  std::vector<Corner> best(grid.size());
  float penalty = 1;
  for (int l = 0; l < std::min(kCornerLevels + blurred_levels, pyramid.levels());
       ++l, penalty *= kLevelPenalty) {
    const Image<float> scores =
        cornerScores(pyramid.level(l), static_cast<float>(options.min_corner_ratio));
    const float threshold = leastScore(options.min_corner_score, noise, l, options);
    for (int y = kCornerMargin; y < scores.height - kCornerMargin; ++y) {
      const float* row = scores.row(y);
      for (int x = kCornerMargin; x < scores.width - kCornerMargin; ++x) {
        const float score = row[x];
        if (score < threshold || score < row[x - 1] || score < row[x + 1]) continue;
        const Vector2d u_px = fromLevel(Vector2d(x, y), l);
        const size_t cell = grid.cellOf(u_px);
        if (occupied[cell] || score * penalty <= best[cell].score) continue;
        if (isLocalMaximum(scores, x, y)) best[cell] = {u_px, l, score * penalty};
      }
    }
  }
  return strongest(std::move(best), count);
}

}  // namespace diorama::vo
