// Errors of one pose of an object, symmetries taken into account.
#pragma once

#include <optional>
#include <vector>

#include "core/object_model.h"
#include "core/se3.h"

namespace diorama {

struct PoseError {
  double translation_m = 0;
  double rotation_rad = 0;
};

PoseError poseError(const SE3& estimate, const SE3& truth);

// Among the true poses that look the same, the one nearest to the estimate: least
// |translation|^2 + (lever_m * angle)^2. Symmetries as in BOP: discrete ones, each combined with
// any rotation about the axis.
SE3 nearestSymmetricPose(const SE3& estimate, const SE3& truth, const Symmetries& symmetries,
                         double lever_m = 0.1);

// e^T P^-1 e with truth = estimate * Exp(e), P in the right tangent of the estimate; 6 on average
// when P is right. Nothing when P is not finite or not positive definite.
std::optional<double> normalisedError(const SE3& estimate, const Matrix6d& covariance,
                                      const SE3& truth);

// ADD and ADD-S (Hinterstoisser et al. 2012) over some of the mesh's vertices.
class ModelDistance {
 public:
  // At most max_points vertices, evenly picked; symmetric objects use ADD-S.
  explicit ModelDistance(const ObjectModel& model, size_t max_points = 500);

  // Mean distance in m; nothing when the model has no vertices.
  std::optional<double> operator()(const SE3& estimate, const SE3& truth) const;

 private:
  std::vector<Vector3d> points_;
  bool symmetric_ = false;
};

}  // namespace diorama
