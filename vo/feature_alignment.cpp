#include "vo/feature_alignment.h"

#include <Eigen/LU>
#include <numeric>

namespace diorama::vo {
namespace {

constexpr int kSteps = 10;
constexpr double kSettled = 0.03;                  // px (SVO)
constexpr float kMinGain = 0.4f, kMaxGain = 2.5f;  // beyond them it is something else
constexpr int kSize = Patch::kSize, kArea = kSize * kSize;

// d value / d (u, v), 1 (offset) and the value itself about its mean (gain), for each pixel.
struct Template {
  std::array<float, kArea> gx, gy, value;  // value: about the mean
  float mean = 0;
  Eigen::Matrix4f inverse_hessian;

  Template(const Patch& patch, bool with_gain) {
    value = patch.inner();
    mean = std::accumulate(value.begin(), value.end(), 0.f) / kArea;
    Eigen::Matrix4f H = Eigen::Matrix4f::Zero();
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const size_t k = static_cast<size_t>(y * kSize + x);
        gx[k] = 0.5f * (patch.at(x + 1, y) - patch.at(x - 1, y));
        gy[k] = 0.5f * (patch.at(x, y + 1) - patch.at(x, y - 1));
        value[k] -= mean;
        const Eigen::Vector4f j(gx[k], gy[k], 1, value[k]);
        H += j * j.transpose();
      }
    if (!with_gain) {
      H.row(3).setZero();
      H.col(3).setZero();
      H(3, 3) = 1;
    }
    H.diagonal().array() += 1e-3f;  // a blank patch has no gradient
    inverse_hessian = H.inverse();
  }
};

}  // namespace

std::optional<AlignedPatch> alignFeature(const Image<uint8_t>& image, const Patch& patch,
                                         const Vector2d& start, double max_shift, bool with_gain) {
  const Template t(patch, with_gain);
  std::array<float, kArea> seen;
  Vector2d u = start;
  float gain = 1, offset = 0;  // of the seen values about the template's mean
  for (int step = 0; step < kSteps; ++step) {
    if (!sampleBlock<kSize>(image, u, seen.data())) return std::nullopt;
    if (step == 0) offset = std::accumulate(seen.begin(), seen.end(), 0.f) / kArea - t.mean;
    float ex = 0, ey = 0, e1 = 0, ev = 0, squares = 0;
    for (size_t k = 0; k < kArea; ++k) {
      const float r = seen[k] - (gain * t.value[k] + t.mean + offset);
      ex += r * t.gx[k];
      ey += r * t.gy[k];
      e1 += r;
      ev += r * t.value[k];
      squares += r * r;
    }
    const Eigen::Vector4f d = t.inverse_hessian * Eigen::Vector4f(ex, ey, e1, with_gain ? ev : 0.f);
    if (!d.allFinite()) return std::nullopt;
    u -= d.head<2>().cast<double>();
    offset += d[2];
    if (with_gain) gain += d[3];
    if ((u - start).norm() > max_shift) return std::nullopt;
    if (d.head<2>().norm() < kSettled) {
      if (gain < kMinGain || gain > kMaxGain) return std::nullopt;
      const float variance = squares / kArea;
      return AlignedPatch{u, std::sqrt(static_cast<double>(variance)), static_cast<double>(gain),
                          (variance * t.inverse_hessian.topLeftCorner<2, 2>()).cast<double>()};
    }
  }
  return std::nullopt;
}

}  // namespace diorama::vo
