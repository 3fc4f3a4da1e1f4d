#include "vo/whole_image.h"

#include <algorithm>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kLevel = 4;
constexpr double kLargestShift = 0.35;  // of the image's sides
constexpr double kSmallestShare = 0.4;  // of the pixels must be seen by both
constexpr double kFlat = 1;             // grey levels^2: a blank image is like nothing

// Normalised correlation of the pixels that both see, current(x + dx, y + dy) on reference(x, y).
double correlationAt(const Image<uint8_t>& reference, const Image<uint8_t>& current, int dx,
                     int dy) {
  const int x0 = std::max(0, -dx), x1 = std::min(reference.width, current.width - dx);
  const int y0 = std::max(0, -dy), y1 = std::min(reference.height, current.height - dy);
  int64_t a = 0, b = 0, aa = 0, bb = 0, ab = 0, n = 0;
  for (int y = y0; y < y1; ++y) {
    const uint8_t *p = reference.row(y), *q = current.row(y + dy) + dx;
    for (int x = x0; x < x1; ++x) {
      const int u = p[x], v = q[x];
      a += u, b += v, aa += u * u, bb += v * v, ab += u * v;
    }
    n += x1 - x0;
  }
  const double count = static_cast<double>(n);
  if (count < kSmallestShare * reference.width * reference.height) return -1;
  const auto covariance = [&](int64_t xy, int64_t x, int64_t y) {
    return (static_cast<double>(xy) - static_cast<double>(x) * static_cast<double>(y) / count) /
           count;
  };
  const double variance_a = covariance(aa, a, a), variance_b = covariance(bb, b, b);
  if (variance_a < kFlat || variance_b < kFlat) return -1;
  return covariance(ab, a, b) / std::sqrt(variance_a * variance_b);
}

}  // namespace

WholeImageMatch matchWholeImages(const Camera& camera, const ImagePyramid& reference,
                                 const ImagePyramid& current) {
  const int level = std::min({kLevel, reference.levels() - 1, current.levels() - 1});
  const Image<uint8_t>& a = reference.level(level);
  const Image<uint8_t>& b = current.level(level);
  const int reach_x = static_cast<int>(kLargestShift * a.width);
  const int reach_y = static_cast<int>(kLargestShift * a.height);
  WholeImageMatch best;
  Vector2d shift = Vector2d::Zero();
  for (int dy = -reach_y; dy <= reach_y; ++dy)
    for (int dx = -reach_x; dx <= reach_x; ++dx)
      if (const double c = correlationAt(a, b, dx, dy); c > best.correlation) {
        best.correlation = c;
        shift = Vector2d(dx, dy);
      }
  const Vector2d centre(0.5 * (camera.width() - 1), 0.5 * (camera.height() - 1));
  const auto before = camera.unproject(centre);
  const auto after = camera.unproject(centre + shift / levelScale(level));
  if (before && after)
    best.T_current_reference.rotation = Eigen::Quaterniond::FromTwoVectors(*before, *after);
  return best;
}

}  // namespace diorama::vo
