// The frame's pose from the pixels of its features: robust Gauss-Newton on reprojection errors.
#pragma once

#include "vo/map.h"
#include "vo/motion_model.h"
#include "vo/vo_options.h"

namespace diorama::vo {

struct PoseRefinement {
  bool converged = false;               // there was a pose to find
  int agreed = 0;                       // features left in the frame
  int agreed_settled = 0;               // ... of points that are settled
  std::vector<MapPoint*> disagreed;     // points of the features that were dropped
  double rms_px = 0;                    // of their errors, at their level
  Matrix6d hessian = Matrix6d::Zero();  // of whitened errors, right tangent
};

// Changes frame.T_world_camera and drops the features that do not agree with it.
PoseRefinement refinePose(const Camera& camera, TrackedFrame& frame, const VoOptions& options,
                          const std::optional<PositionPrior>& prior = {});

// Jacobian of a point's pixel by the right perturbation of T_world_camera: J_projection [-I |
// [p]x].
inline Matrix26d poseJacobian(const Matrix23d& J_projection, const Vector3d& p_camera) {
  Matrix26d J;
  J << -J_projection, J_projection * skew(p_camera);
  return J;
}

}  // namespace diorama::vo
