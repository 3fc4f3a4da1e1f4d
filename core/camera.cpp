#include "core/camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/errors.h"

namespace diorama {
namespace {

// tan of 89.4 degrees: rays farther out have no useful direction with z = 1.
constexpr double kLargestRadius = 100;

struct ModelName {
  CameraModel model;
  const char* name;
};
constexpr ModelName kModelNames[] = {{CameraModel::kPinhole, "pinhole"},
                                     {CameraModel::kRadTan, "radtan"},
                                     {CameraModel::kFisheye, "fisheye"}};

}  // namespace

std::string toString(CameraModel model) {
  for (const ModelName& m : kModelNames)
    if (m.model == model) return m.name;
  return "unknown";
}

std::optional<CameraModel> cameraModelFromString(const std::string& name) {
  for (const ModelName& m : kModelNames)
    if (m.name == name) return m.model;
  return std::nullopt;
}

std::optional<std::string> CameraParameters::problem() const {
  if (width < 1 || height < 1 || width > 16384 || height > 16384)
    return "the image size must be between 1 and 16384 pixels";
  if (!(fx > 0) || !(fy > 0) || !std::isfinite(fx) || !std::isfinite(fy))
    return "fx and fy must be positive";
  if (!std::isfinite(cx) || !std::isfinite(cy)) return "cx and cy must be finite";
  for (double k : distortion)
    if (!std::isfinite(k)) return "the distortion must be finite";
  const size_t n = distortion.size();
  if (model == CameraModel::kPinhole && n != 0) return "a pinhole camera takes no distortion";
  if (model == CameraModel::kRadTan && n != 0 && n != 4 && n != 5 && n != 8)
    return "radtan takes 0, 4, 5 or 8 distortion coefficients";
  if (model == CameraModel::kFisheye && n != 0 && n != 4)
    return "fisheye takes 0 or 4 distortion coefficients";
  return std::nullopt;
}

Camera::Camera(CameraParameters parameters) : parameters_(std::move(parameters)) {
  DIORAMA_CHECK(!parameters_.problem());
  std::copy(parameters_.distortion.begin(), parameters_.distortion.end(), k_.begin());
  distorted_ = parameters_.model == CameraModel::kFisheye ||
               std::any_of(k_.begin(), k_.end(), [](double k) { return k != 0; });
  max_radius_ = findMaxRadius();
}

// Inlined, so that those who need no Jacobian do not pay for it.
[[gnu::always_inline]] inline Camera::Distorted Camera::distortRadTan(const Vector2d& xy) const {
  const double x = xy.x(), y = xy.y(), r2 = x * x + y * y;
  const auto [k1, k2, p1, p2, k3, k4, k5, k6] = k_;
  const double numerator = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double radial = numerator / denominator;
  // d radial / d r2
  const double slope =
      ((k1 + r2 * (2 * k2 + r2 * 3 * k3)) - radial * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) /
      denominator;
  Distorted out;
  out.xy = {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  const double cross = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
  out.J << radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x, cross, cross,
      radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
  return out;
}

[[gnu::always_inline]] inline Camera::Distorted Camera::distortFisheye(const Vector2d& xy) const {
  const double r = xy.norm(), theta = std::atan(r), t2 = theta * theta;
  const double poly = 1 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3])));
  const double slope = 1 + t2 * (3 * k_[0] + t2 * (5 * k_[1] + t2 * (7 * k_[2] + t2 * 9 * k_[3])));
  if (r < 1e-8) return {xy, Matrix2d::Identity()};
  const double scale = theta * poly / r;      // distorted over undistorted radius
  const double radial = slope / (1 + r * r);  // d distorted / d undistorted radius
  const Vector2d n = xy / r;
  const Matrix2d nn = n * n.transpose();
  return {scale * xy, radial * nn + scale * (Matrix2d::Identity() - nn)};
}

[[gnu::always_inline]] inline Camera::Distorted Camera::distort(const Vector2d& xy) const {
  return parameters_.model == CameraModel::kFisheye ? distortFisheye(xy) : distortRadTan(xy);
}

// The largest radius up to which the radial part grows with the radius.
double Camera::findMaxRadius() const {
  if (!distorted_) return kLargestRadius;
  const auto grows = [&](double r) {
    constexpr double h = 1e-6;
    return distort({r + h, 0}).xy.norm() > distort({r, 0}).xy.norm();
  };
  constexpr int steps = 2000;
  for (int i = 0; i < steps; ++i) {
    const double r = std::tan((i + 1) * std::atan(kLargestRadius) / steps);
    if (!grows(r)) return std::tan(i * std::atan(kLargestRadius) / steps);
  }
  return kLargestRadius;
}

std::optional<Vector2d> Camera::project(const Vector3d& p) const {
  if (!(p.z() > 1e-9)) return std::nullopt;
  Vector2d xy = p.head<2>() / p.z();
  if (!(xy.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
  if (distorted_) xy = distort(xy).xy;
  return Vector2d(parameters_.fx * xy.x() + parameters_.cx,
                  parameters_.fy * xy.y() + parameters_.cy);
}

std::optional<ProjectionWithJacobian> Camera::projectWithJacobian(const Vector3d& p) const {
  if (!(p.z() > 1e-9)) return std::nullopt;
  const double inverse_z = 1 / p.z();
  const Vector2d xy = p.head<2>() * inverse_z;
  if (!(xy.squaredNorm() <= max_radius_ * max_radius_)) return std::nullopt;
  Distorted d{xy, Matrix2d::Identity()};
  if (distorted_) d = distort(xy);
  const Eigen::DiagonalMatrix<double, 2> f(parameters_.fx, parameters_.fy);
  Matrix23d normalise;
  normalise << inverse_z, 0, -xy.x() * inverse_z, 0, inverse_z, -xy.y() * inverse_z;
  return ProjectionWithJacobian{f * d.xy + Vector2d(parameters_.cx, parameters_.cy),
                                f * (d.J * normalise)};
}

std::optional<Vector3d> Camera::unproject(const Vector2d& u) const {
  const Vector2d target((u.x() - parameters_.cx) / parameters_.fx,
                        (u.y() - parameters_.cy) / parameters_.fy);
  if (!target.allFinite()) return std::nullopt;
  if (!distorted_) return Vector3d(target.x(), target.y(), 1);
  if (parameters_.model == CameraModel::kFisheye && !(target.norm() < 3.15)) return std::nullopt;
  // Newton on the distortion, kept inside the radius where it is one-to-one.
  Vector2d xy = target;
  if (const double r = xy.norm(); r > 0.9 * max_radius_) xy *= 0.9 * max_radius_ / r;
  for (int i = 0; i < 50; ++i) {
    const Distorted d = distort(xy);
    const Vector2d residual = d.xy - target;
    if (!residual.allFinite()) return std::nullopt;
    Vector2d step = d.J.inverse() * residual;
    if (!step.allFinite()) return std::nullopt;
    const double limit = 0.3 * (1 + xy.norm());
    if (step.norm() > limit) step *= limit / step.norm();
    xy -= step;
    if (step.norm() < 1e-14 * (1 + xy.norm())) break;
    if (const double r = xy.norm(); r > max_radius_) xy *= max_radius_ / r;
  }
  if ((distort(xy).xy - target).norm() > 1e-9 * (1 + target.norm())) return std::nullopt;
  return Vector3d(xy.x(), xy.y(), 1);
}

}  // namespace diorama
