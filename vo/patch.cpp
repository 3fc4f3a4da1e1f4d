#include "vo/patch.h"

#include <Eigen/LU>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kHalf = Patch::kBordered / 2;  // offsets -5 .. 4

// Areas of a patch in the other view, in pixels of its level: what is smaller has lost its texture,
// what is larger is a blur.
constexpr double kSmallestArea = 0.05, kLargestArea = 60;
constexpr double kCoarserAbove = 3;  // (SVO)

// Smeared along `smear`, in pixels of the image.
bool fits(const Image<uint8_t>& image, const Vector2d& centre, const Matrix2d& A,
          const Vector2d& smear = Vector2d::Zero()) {
  const double reach_x =
      kHalf * (std::abs(A(0, 0)) + std::abs(A(0, 1))) + 0.5 * std::abs(smear.x());
  const double reach_y =
      kHalf * (std::abs(A(1, 0)) + std::abs(A(1, 1))) + 0.5 * std::abs(smear.y());
  return centre.x() - reach_x >= 0 && centre.y() - reach_y >= 0 &&
         centre.x() + reach_x < image.width - 1 && centre.y() + reach_y < image.height - 1;
}

// Values of the image at centre + A * offset.
Patch sampleAffine(const Image<uint8_t>& image, const Vector2d& centre, const Matrix2d& A) {
  constexpr size_t kPixels = Patch::kBordered * Patch::kBordered;
  const Eigen::Matrix2f a = A.cast<float>();
  const Eigen::Vector2f c = centre.cast<float>();
  // Where they lie, what the four pixels around are, and what is between: reading apart from
  // reckoning, which is done in vectors.
  std::array<float, kPixels> x, y;
  std::array<uint8_t, kPixels> p00, p01, p10, p11;
  std::array<int, kPixels> at;
  for (int row = 0; row < Patch::kBordered; ++row)
    for (int column = 0; column < Patch::kBordered; ++column) {
      const size_t k = static_cast<size_t>(row * Patch::kBordered + column);
      const float dx = static_cast<float>(column - kHalf), dy = static_cast<float>(row - kHalf);
      x[k] = c.x() + a(0, 0) * dx + a(0, 1) * dy;
      y[k] = c.y() + a(1, 0) * dx + a(1, 1) * dy;
    }
  for (size_t k = 0; k < kPixels; ++k) {
    const int xi = static_cast<int>(x[k]), yi = static_cast<int>(y[k]);
    x[k] -= static_cast<float>(xi);
    y[k] -= static_cast<float>(yi);
    at[k] = yi * image.width + xi;
  }
  const uint8_t* pixels = image.row(0);
  for (size_t k = 0; k < kPixels; ++k) {
    const uint8_t *p = pixels + at[k], *q = p + image.width;
    p00[k] = p[0];
    p01[k] = p[1];
    p10[k] = q[0];
    p11[k] = q[1];
  }
  Patch patch;
  for (size_t k = 0; k < kPixels; ++k) {
    const float top = static_cast<float>(p00[k]) + x[k] * static_cast<float>(p01[k] - p00[k]);
    const float bottom = static_cast<float>(p10[k]) + x[k] * static_cast<float>(p11[k] - p10[k]);
    patch.bordered[k] = top + y[k] * (bottom - top);
  }
  return patch;
}

// The mean of the patches that are passed over.
Patch sampleSmeared(const Image<uint8_t>& image, const Vector2d& centre, const Matrix2d& A,
                    const Vector2d& smear, int samples) {
  Patch sum = sampleAffine(image, centre - 0.5 * (samples - 1) / samples * smear, A);
  for (int k = 1; k < samples; ++k) {
    const double part = (k + 0.5) / samples - 0.5;
    const Patch one = sampleAffine(image, centre + part * smear, A);
    for (size_t i = 0; i < sum.bordered.size(); ++i) sum.bordered[i] += one.bordered[i];
  }
  for (float& value : sum.bordered) value /= static_cast<float>(samples);
  return sum;
}

}  // namespace

std::array<float, Patch::kSize * Patch::kSize> Patch::inner() const {
  std::array<float, kSize * kSize> values;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) values[static_cast<size_t>(y * kSize + x)] = at(x, y);
  return values;
}

std::optional<Patch> cutPatch(const ImagePyramid& pyramid, const Vector2d& u_px, int level) {
  const Vector2d centre = toLevel(u_px, level);
  if (!fits(pyramid.level(level), centre, Matrix2d::Identity())) return std::nullopt;
  Patch patch = sampleAffine(pyramid.level(level), centre, Matrix2d::Identity());
  patch.level = level;
  return patch;
}

std::optional<Patch> warpPatch(const Camera& camera, const ImagePyramid& reference,
                               const Vector2d& u_px, int level, const Vector3d& p_reference,
                               const SE3& T_other_reference, int levels, const Vector2d& smear_px) {
  const auto here = camera.projectWithJacobian(p_reference);
  const auto there = camera.projectWithJacobian(T_other_reference * p_reference);
  if (!here || !there) return std::nullopt;
  // d u_other / d u_reference, for points of equal depth in the reference.
  const Matrix2d to_plane = here->J.leftCols<2>();
  const Matrix2d A =
      there->J * T_other_reference.rotationMatrix().leftCols<2>() * to_plane.inverse();
  double area = std::abs(A.determinant()) * (1 << (2 * level));
  if (!(area > kSmallestArea && area < kLargestArea)) return std::nullopt;
  int found_level = 0;
  for (; area > kCoarserAbove && found_level + 1 < levels; ++found_level) area /= 4;

  const Matrix2d back = A.inverse() * (levelScale(level) / levelScale(found_level));
  const Vector2d centre = toLevel(u_px, level);
  const Image<uint8_t>& image = reference.level(level);
  const Vector2d smear_found = smear_px * levelScale(found_level), smear = back * smear_found;
  if (!back.allFinite() || !fits(image, centre, back, smear)) return std::nullopt;
  const int samples = static_cast<int>(std::ceil(std::min(smear_found.norm(), 15.0)));
  Patch patch = samples < 2 ? sampleAffine(image, centre, back)
                            : sampleSmeared(image, centre, back, smear, samples);
  patch.level = found_level;
  return patch;
}

}  // namespace diorama::vo
