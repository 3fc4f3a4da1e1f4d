#include "vo/whole_image.h"

#include <algorithm>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kLevel = 4;
constexpr double kLargestShift = 0.35;  // of the image's sides
constexpr double kSmallestShare = 0.4;  // of the pixels must be seen by both
constexpr int kRefined = 2;             // px about twice the best shift at half the size
constexpr double kFlat = 1;             // grey levels^2: a blank image is like nothing

// Normalised correlation of the pixels that both see, current(x + dx, y + dy) on reference(x, y).
double correlationAt(const Image<uint8_t>& reference, const Image<uint8_t>& current, int dx,
                     int dy) {
  const int x0 = std::max(0, -dx), x1 = std::min(reference.width, current.width - dx);
  const int y0 = std::max(0, -dy), y1 = std::min(reference.height, current.height - dy);
  int64_t a = 0, b = 0, aa = 0, bb = 0, ab = 0, n = 0;
  for (int y = y0; y < y1; ++y) {
    const uint8_t *p = reference.row(y), *q = current.row(y + dy) + dx;
    int row_a = 0, row_b = 0, row_aa = 0, row_bb = 0, row_ab = 0;
    for (int x = x0; x < x1; ++x) {
      const int u = p[x], v = q[x];
      row_a += u, row_b += v, row_aa += u * u, row_bb += v * v, row_ab += u * v;
    }
    a += row_a, b += row_b, aa += row_aa, bb += row_bb, ab += row_ab, n += x1 - x0;
  }
  const double count = static_cast<double>(n);
  if (count < kSmallestShare * reference.width * reference.height) return -1;
  const auto covariance = [&](int64_t sum_xy, int64_t sum_x, int64_t sum_y) {
    const double xy = static_cast<double>(sum_xy), x = static_cast<double>(sum_x),
                 y = static_cast<double>(sum_y);
    return (xy - x * y / count) / count;
  };
  const double variance_a = covariance(aa, a, a), variance_b = covariance(bb, b, b);
  if (variance_a < kFlat || variance_b < kFlat) return -1;
  return covariance(ab, a, b) / std::sqrt(variance_a * variance_b);
}

struct Shift {
  int x = 0, y = 0;
  double correlation = -1;
};

// The best shift within `reach` of `about`.
Shift bestShift(const Image<uint8_t>& reference, const Image<uint8_t>& current, const Shift& about,
                int reach_x, int reach_y) {
  Shift best;
  for (int y = about.y - reach_y; y <= about.y + reach_y; ++y)
    for (int x = about.x - reach_x; x <= about.x + reach_x; ++x)
      if (const double c = correlationAt(reference, current, x, y); c > best.correlation)
        best = {x, y, c};
  return best;
}

}  // namespace

// All shifts at half the size, then those about the best one.
WholeImageMatch matchWholeImages(const Camera& camera, const ImagePyramid& reference,
                                 const ImagePyramid& current) {
  const int level = std::min({kLevel, reference.levels() - 1, current.levels() - 1});
  const Image<uint8_t>& a = reference.level(level);
  const Image<uint8_t>& b = current.level(level);
  Image<uint8_t> half_a, half_b;
  halve(a, half_a);
  halve(b, half_b);
  const Shift coarse = bestShift(half_a, half_b, {}, static_cast<int>(kLargestShift * half_a.width),
                                 static_cast<int>(kLargestShift * half_a.height));
  const Shift fine = bestShift(a, b, {2 * coarse.x, 2 * coarse.y}, kRefined, kRefined);
  WholeImageMatch best;
  best.correlation = fine.correlation;
  const Vector2d shift(fine.x, fine.y);
  const Vector2d centre(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  const auto before = camera.unproject(centre);
  const auto after = camera.unproject(centre + shift / levelScale(level));
  if (before && after)
    best.T_current_reference.rotation = Eigen::Quaterniond::FromTwoVectors(*before, *after);
  return best;
}

}  // namespace diorama::vo
