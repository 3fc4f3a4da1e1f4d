#include "eval/pose_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace diorama {
namespace {

// The rotation about the axis that brings `from` nearest to `to` (swing-twist decomposition).
SE3 turnedTowards(const SE3& from, const SE3& to, const Vector3d& axis) {
  const Eigen::Quaterniond q = from.rotation.conjugate() * to.rotation;
  const double angle = 2 * std::atan2(q.vec().dot(axis), q.w());
  return from * SE3{expSO3(angle * axis), Vector3d::Zero()};
}

bool isSymmetric(const Symmetries& symmetries) {
  return symmetries.axis || !symmetries.discrete.empty();
}

}  // namespace

PoseError poseError(const SE3& estimate, const SE3& truth) {
  return {(estimate.translation - truth.translation).norm(),
          angleBetween(estimate.rotation, truth.rotation)};
}

SE3 nearestSymmetricPose(const SE3& estimate, const SE3& truth, const Symmetries& symmetries,
                         double lever_m) {
  SE3 best = truth;
  double best_cost = std::numeric_limits<double>::infinity();
  const auto consider = [&](SE3 candidate) {
    if (symmetries.axis) candidate = turnedTowards(candidate, estimate, *symmetries.axis);
    const PoseError error = poseError(estimate, candidate);
    const double angle = lever_m * error.rotation_rad;
    const double cost = error.translation_m * error.translation_m + angle * angle;
    if (cost >= best_cost) return;
    best_cost = cost;
    best = candidate;
  };
  consider(truth);
  for (const SE3& symmetry : symmetries.discrete) consider(truth * symmetry);
  return best;
}

std::optional<double> normalisedError(const SE3& estimate, const Matrix6d& covariance,
                                      const SE3& truth) {
  if (!covariance.allFinite()) return std::nullopt;
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (llt.info() != Eigen::Success) return std::nullopt;
  const Vector6d e = log(estimate.inverse() * truth);
  const double value = e.dot(llt.solve(e));
  if (!std::isfinite(value)) return std::nullopt;
  return value;
}

ModelDistance::ModelDistance(const ObjectModel& model, size_t max_points)
    : symmetric_(isSymmetric(model.symmetries)) {
  const std::vector<Vector3f>& all = model.mesh.positions;
  const size_t count = std::min(all.size(), max_points);
  for (size_t i = 0; i < count; ++i) points_.push_back(all[i * all.size() / count].cast<double>());
}

std::optional<double> ModelDistance::operator()(const SE3& estimate, const SE3& truth) const {
  if (points_.empty()) return std::nullopt;
  const SE3 T_estimate_truth =
      estimate.inverse() * truth;  // distances do not change with the frame
  double sum = 0;
  for (const Vector3d& point : points_) {
    const Vector3d p = T_estimate_truth * point;
    double squared = (p - point).squaredNorm();
    if (symmetric_)
      for (const Vector3d& other : points_) squared = std::min(squared, (p - other).squaredNorm());
    sum += std::sqrt(squared);
  }
  return sum / static_cast<double>(points_.size());
}

}  // namespace diorama
