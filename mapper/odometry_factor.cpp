#include "mapper/odometry_factor.h"

#include <ceres/cost_function.h>

#include <cmath>

namespace diorama {

OdometryFactorResult makeOdometryFactor(const OdometryMeasurement& m, double sigma_scale) {
  if (!(m.health > 0)) return {std::nullopt, "no measurement (health 0)"};
  if (!isUnitPose(m.T_from_to)) return {std::nullopt, "the pose is not finite, or no rotation"};
  const std::optional<Matrix6d> W = whitening(sigma_scale * sigma_scale * m.covariance);
  if (!W) return {std::nullopt, "the covariance is not finite or not positive definite"};
  return {OdometryFactor{m.T_from_to, *W}, ""};
}

OdometryFactor makeGapFactor(double seconds, double sigma_m_s, double sigma_rad_s) {
  Vector6d w;
  w << Vector3d::Constant(1 / (sigma_m_s * seconds)),
      Vector3d::Constant(1 / (sigma_rad_s * seconds));
  return {SE3{}, w.asDiagonal()};
}

LinearisedPair linearise(const OdometryFactor& factor, const RobustKernel& kernel,
                         const SE3& T_world_from, const SE3& T_world_to) {
  return whitened(linearise(factor.Z, T_world_from, T_world_to), factor.W, kernel);
}

std::unique_ptr<ceres::CostFunction> makeCost(const OdometryFactor& factor) {
  return makeRelativePoseCost(factor.Z, factor.W);
}

}  // namespace diorama
