// An object seen from a camera pose:
//   r = W * Log(Z^-1 * T_world_camera^-1 * T_world_object), with a robust kernel on |r|^2.
// Or what is known of it beforehand, whoever sees it: r = W * Log(Z^-1 * T_world_object).
#pragma once

#include <optional>
#include <string>

#include "core/measurements.h"
#include "mapper/relative_pose.h"
#include "mapper/robust_kernel.h"

namespace diorama {

struct ObjectFactor {
  size_t object = 0;  // position in the graph's list
  SE3 Z;              // measured T_camera_object
  Whitening W;
  bool prior = false;  // Z is T_world_object; it enters the graph with the pose that it belongs to
};

// The factor of a measurement, or why there is none.
struct ObjectFactorResult {
  std::optional<ObjectFactor> factor;
  std::string reason;
};
ObjectFactorResult makeObjectFactor(const ObjectMeasurement& measurement, size_t object,
                                    double sigma_scale);

Matrix6d covarianceOf(const ObjectFactor& factor);  // in the right tangent of Z

// Whitened, with the root of the kernel's weight.
LinearisedPair linearise(const ObjectFactor& factor, const RobustKernel& kernel,
                         const SE3& T_world_camera, const SE3& T_world_object);

std::unique_ptr<ceres::CostFunction> makeCost(const ObjectFactor& factor);  // without the kernel

}  // namespace diorama
