#include "tracker/look_cue.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr size_t kFewest = 24;           // points for an alignment
constexpr double kSmallestScale = 0.03;  // of the logarithms: noise and rounding
constexpr double kTukey = 4.6851;
constexpr double kRidge = 1e-6;  // normals of a flat side depend on one another

using Light = Eigen::Matrix<double, 4, 3>;
using Crossed = Eigen::Matrix<double, 6, 4>;

}  // namespace

LookCue::LookCue(const DatabaseLook& look, const MeanImage& image, const Camera& camera,
                 const Vector3d& centre_object, int most_points)
    : look_(look),
      image_(image),
      camera_(camera),
      centre_object_(centre_object),
      step_(1 + look.points.size() / static_cast<size_t>(std::max(1, most_points))) {}

// The image's slope is taken over the patch that a value is the mean of.
bool LookCue::measure(const SE3& T, const Matrix3d& R, size_t index, Point& out) const {
  const Vector3d p = look_.points[index].cast<double>() - centre_object_;
  const Vector3d normal = look_.normals[index].cast<double>();
  const Vector3d seen_from = R * p + T.translation;
  if (seen_from.dot(R * normal) >= 0) return false;  // turned away
  const auto projection = camera_.projectWithJacobian(seen_from);
  if (!projection) return false;
  const Vector2d& u = projection->u_px;
  const double side = static_cast<double>(look_.side_m) * camera_.fx() / seen_from.z();
  const double reach = std::max(1.0, std::round(0.5 * side));
  const auto value = [&](double dx, double dy) {
    const auto color = image_.mean(u + Vector2d(dx, dy), side);
    return color ? std::optional(lookValue(*color, image_.hasColors())) : std::nullopt;
  };
  const auto here = value(0, 0), left = value(-reach, 0), right = value(reach, 0),
             above = value(0, -reach), below = value(0, reach);
  if (!here || !left || !right || !above || !below) return false;
  Eigen::Matrix<double, 3, 2> slope;
  slope << (*right - *left).cast<double>(), (*below - *above).cast<double>();
  out.light << normal, 1;
  out.residual = (*here - lookValue(look_.colors[index], image_.hasColors())).cast<double>();
  out.J = slope / (2 * reach) * pointJacobian(projection->J, R, p);
  return true;
}

// Takes from the residuals what is linear in the normals. Returns the scale of the rest.
Vector3d LookCue::removeLight() {
  Eigen::Matrix4d normals =
      kRidge * static_cast<double>(points_.size()) * Eigen::Matrix4d::Identity();
  Light sums = Light::Zero();
  for (const Point& point : points_) {
    normals += point.light * point.light.transpose();
    sums += point.light * point.residual.transpose();
  }
  const Light light = normals.ldlt().solve(sums);
  Vector3d scale;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> sizes;
    for (Point& point : points_) {
      point.residual[c] -= point.light.dot(light.col(c));
      sizes.push_back(std::abs(point.residual[c]));
    }
    scale[c] = std::max(kSmallestScale, robustScale(sizes));
  }
  return scale;
}

CueEquations LookCue::linearise(const SE3& T) {
  points_.clear();
  const Matrix3d R = T.rotationMatrix();
  for (size_t i = 0; i < look_.points.size(); i += step_)
    if (Point point; measure(T, R, i, point)) points_.push_back(point);
  CueEquations equations;
  if (points_.size() < kFewest) return equations;
  const Vector3d scale = removeLight();
  Eigen::Matrix4d normals =
      kRidge * static_cast<double>(points_.size()) * Eigen::Matrix4d::Identity();
  Crossed crossed[3] = {Crossed::Zero(), Crossed::Zero(), Crossed::Zero()};
  Light sums = Light::Zero();
  for (const Point& point : points_) {
    const Vector3d scaled = point.residual.cwiseQuotient(scale);
    const double weight = tukeyWeight(scaled.norm(), kTukey);
    if (weight <= 0) continue;
    normals += weight * point.light * point.light.transpose();
    for (int c = 0; c < 3; ++c) {
      const Vector6d J = point.J.row(c).transpose() / scale[c];
      equations.add(J, scaled[c], weight);
      crossed[c] += weight * J * point.light.transpose();
      sums.col(c) += weight * scaled[c] * point.light;
    }
    equations.residuals += 3;
  }
  // The light is unknown, too: what it might explain tells nothing about the pose.
  const Eigen::LDLT<Eigen::Matrix4d> solver(normals);
  for (int c = 0; c < 3; ++c) {
    equations.hessian -= crossed[c] * solver.solve(crossed[c].transpose());
    equations.gradient -= crossed[c] * solver.solve(sums.col(c));
  }
  return equations;
}

}  // namespace diorama
