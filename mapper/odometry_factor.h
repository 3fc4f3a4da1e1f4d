// Odometry between two consecutive camera poses:
//   r = W * Log(Z^-1 * T_world_camera(k)^-1 * T_world_camera(k+1)), with a robust kernel on |r|^2.
// The scale of an odometry may be unknown: Z's translation counts e^s times, with a variable s.
#pragma once

#include <optional>
#include <string>

#include "core/measurements.h"
#include "mapper/relative_pose.h"
#include "mapper/robust_kernel.h"

namespace diorama {

struct OdometryFactor {
  SE3 Z;  // measured T_from_to
  Whitening W;
  std::optional<size_t> scale = {};  // whose s; a variable among the graph's objects (graph.h)
};

// The motion when lengths are e^s times as long.
SE3 scaled(const SE3& Z, double s);

// Of an odometry that does not know its scale: one sigma of s, half as long or twice. Errors of its
// steps are as much larger.
constexpr double kUnknownScale = 1;

// The factor of a measurement, or why there is none.
struct OdometryFactorResult {
  std::optional<OdometryFactor> factor;
  std::string reason;
};
OdometryFactorResult makeOdometryFactor(const OdometryMeasurement& measurement, double sigma_scale);

// Standing still for a while, within speeds (one sigma).
OdometryFactor makeGapFactor(double seconds, double sigma_m_s, double sigma_rad_s);

// Whitened and multiplied with the square root of the kernel's weight, as object factors are; with
// the derivative by s.
struct LinearisedStep : LinearisedPair {
  Vector6d J_scale;
};
LinearisedStep linearise(const OdometryFactor& factor, const RobustKernel& kernel,
                         const SE3& T_world_from, const SE3& T_world_to, double s);

// Without the kernel; with a third block for the scale, of which the first number is s, when the
// factor has one.
std::unique_ptr<ceres::CostFunction> makeCost(const OdometryFactor& factor);

}  // namespace diorama
