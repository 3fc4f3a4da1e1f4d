#include "vo/feature_alignment.h"

#include <Eigen/LU>
#include <numeric>

namespace diorama::vo {
namespace {

constexpr int kSteps = 10;
constexpr double kSettled = 0.03;                  // px (SVO)
constexpr float kMinGain = 0.4f, kMaxGain = 2.5f;  // beyond them it is something else
constexpr int kSize = Patch::kSize, kArea = kSize * kSize;

using Row = Eigen::Array<float, kSize, 1>;  // of a patch: one vector register
using Rows = std::array<Row, kSize>;

// d value / d (u, v), 1 (offset) and the value itself about its mean (gain), for each pixel.
struct Template {
  Rows gx, gy, value;  // value: about the mean
  float mean = 0;
  Eigen::Matrix4f inverse_hessian;

  Template(const Patch& patch, bool with_gain) {
    Row sum = Row::Zero();
    for (size_t y = 0; y < kSize; ++y) {
      const float* p = &patch.bordered[(y + 1) * Patch::kBordered + 1];
      value[y] = Row::Map(p);
      gx[y] = 0.5f * (Row::Map(p + 1) - Row::Map(p - 1));
      gy[y] = 0.5f * (Row::Map(p + Patch::kBordered) - Row::Map(p - Patch::kBordered));
      sum += value[y];
    }
    mean = sum.sum() / kArea;
    for (Row& row : value) row -= mean;
    inverse_hessian = invertedHessian(with_gain);
  }

 private:
  Eigen::Matrix4f invertedHessian(bool with_gain) const {
    const auto dot = [](const Rows& a, const Rows& b) {
      Row sum = a[0] * b[0];
      for (size_t y = 1; y < kSize; ++y) sum += a[y] * b[y];
      return sum.sum();
    };
    const auto total = [](const Rows& a) {
      Row sum = a[0];
      for (size_t y = 1; y < kSize; ++y) sum += a[y];
      return sum.sum();
    };
    const float xy = dot(gx, gy), x1 = total(gx), y1 = total(gy);
    const float xv = dot(gx, value), yv = dot(gy, value);
    Eigen::Matrix4f H;
    H << dot(gx, gx), xy, x1, xv,  //
        xy, dot(gy, gy), y1, yv,   //
        x1, y1, kArea, 0,          //
        xv, yv, 0, dot(value, value);
    if (!with_gain) {
      H.row(3).setZero();
      H.col(3).setZero();
      H(3, 3) = 1;
    }
    H.diagonal().array() += 1e-3f;  // a blank patch has no gradient
    return H.inverse();
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
    Row ex = Row::Zero(), ey = ex, e1 = ex, ev = ex, squares = ex;
    for (size_t y = 0; y < kSize; ++y) {
      const Row r = Row::Map(&seen[y * kSize]) - (gain * t.value[y] + (t.mean + offset));
      ex += r * t.gx[y];
      ey += r * t.gy[y];
      e1 += r;
      ev += r * t.value[y];
      squares += r * r;
    }
    const Eigen::Vector4f d = t.inverse_hessian * Eigen::Vector4f(ex.sum(), ey.sum(), e1.sum(),
                                                                  with_gain ? ev.sum() : 0.f);
    if (!d.allFinite()) return std::nullopt;
    u -= d.head<2>().cast<double>();
    offset += d[2];
    if (with_gain) gain += d[3];
    if ((u - start).norm() > max_shift) return std::nullopt;
    if (d.head<2>().norm() < kSettled) {
      if (gain < kMinGain || gain > kMaxGain) return std::nullopt;
      const float variance = squares.sum() / kArea;
      return AlignedPatch{u, std::sqrt(static_cast<double>(variance)), static_cast<double>(gain),
                          (variance * t.inverse_hessian.topLeftCorner<2, 2>()).cast<double>()};
    }
  }
  return std::nullopt;
}

}  // namespace diorama::vo
