#include "vo/feature_alignment.h"

#include <Eigen/LU>
#include <cmath>
#include <numeric>

namespace diorama::vo {
namespace {

constexpr int kSteps = 10;
constexpr double kSettled = 0.03;                  // px (SVO)
constexpr float kMinGain = 0.4f, kMaxGain = 2.5f;  // beyond them it is something else
constexpr int kSize = Patch::kSize, kArea = kSize * kSize;

using Row = Eigen::Array<float, kSize, 1>;  // of a patch: one vector register
using Rows = std::array<Row, kSize>;

float dot(const Rows& a, const Rows& b) {
  Row sum = a[0] * b[0];
  for (size_t y = 1; y < kSize; ++y) sum += a[y] * b[y];
  return sum.sum();
}

float total(const Rows& a) {
  Row sum = a[0];
  for (size_t y = 1; y < kSize; ++y) sum += a[y];
  return sum.sum();
}

// d value / d (a, b), 1 (offset) and the value itself about its mean (gain), for each pixel.
struct Template {
  Rows gx, gy, value;  // value: about the mean
  // Columns a, b, of unit length: the image's axes, or an edge's normal and tangent.
  Matrix2d axes = Matrix2d::Identity();
  float mean = 0;
  Eigen::Matrix4f inverse_hessian;

  Template(const Patch& patch, bool with_gain, bool edgelet) {
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
    if (edgelet) keepNormal();
    inverse_hessian = invertedHessian(with_gain);
  }

 private:
  // Gradients along the normal; none along the edge, so that nothing moves there.
  void keepNormal() {
    const double angle =
        0.5 * std::atan2(2.0 * static_cast<double>(dot(gx, gy)),
                         static_cast<double>(dot(gx, gx)) - static_cast<double>(dot(gy, gy)));
    Vector2d normal(std::cos(angle), std::sin(angle));
    if (normal.dot(Vector2d(static_cast<double>(total(gx)), static_cast<double>(total(gy)))) < 0)
      normal = -normal;
    axes << normal.x(), -normal.y(), normal.y(), normal.x();
    const Eigen::Vector2f n = normal.cast<float>();
    for (size_t y = 0; y < kSize; ++y) {
      gx[y] = n.x() * gx[y] + n.y() * gy[y];
      gy[y].setZero();
    }
  }

  Eigen::Matrix4f invertedHessian(bool with_gain) const {
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
                                         const Vector2d& start, double max_shift, bool with_gain,
                                         bool edgelet) {
  const Template t(patch, with_gain, edgelet);
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
    u -= t.axes * d.head<2>().cast<double>();
    offset += d[2];
    if (with_gain) gain += d[3];
    if ((u - start).norm() > max_shift) return std::nullopt;
    if (d.head<2>().norm() < kSettled) {
      if (gain < kMinGain || gain > kMaxGain) return std::nullopt;
      const float variance = squares.sum() / kArea;
      const Matrix2d covariance =
          (variance * t.inverse_hessian.topLeftCorner<2, 2>()).cast<double>();
      return AlignedPatch{u, std::sqrt(static_cast<double>(variance)), static_cast<double>(gain),
                          t.axes * covariance * t.axes.transpose(),
                          edgelet ? Vector2d(t.axes.col(0)) : Vector2d::Zero()};
    }
  }
  return std::nullopt;
}

}  // namespace diorama::vo
