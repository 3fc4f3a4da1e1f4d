#include "mapper/object_factor.h"

#include <ceres/cost_function.h>

#include <Eigen/Cholesky>
#include <cmath>

namespace diorama {

ObjectFactorResult makeObjectFactor(const ObjectMeasurement& m, size_t object, double sigma_scale) {
  if (!m.claimed) return {std::nullopt, "the tracker does not claim the object"};
  if (!(m.health > 0)) return {std::nullopt, "no measurement (health 0)"};
  if (!isUnitPose(m.T_camera_object))
    return {std::nullopt, "the pose is not finite, or no rotation"};
  const std::optional<Whitening> W = whitening(sigma_scale * sigma_scale * m.covariance);
  if (!W) return {std::nullopt, "the covariance is not finite or not positive definite"};
  return {ObjectFactor{object, m.T_camera_object, *W}, ""};
}

Matrix6d covarianceOf(const ObjectFactor& factor) {
  const Matrix6d W = factor.W.matrix();
  return (W.transpose() * W).ldlt().solve(Matrix6d::Identity());
}

LinearisedPair linearise(const ObjectFactor& factor, const RobustKernel& kernel,
                         const SE3& T_world_camera, const SE3& T_world_object) {
  LinearisedPair pair = linearise(factor.Z, factor.prior ? SE3{} : T_world_camera, T_world_object);
  if (factor.prior) pair.J_a.setZero();
  return whitened(pair, factor.W.matrix(), kernel);
}

std::unique_ptr<ceres::CostFunction> makeCost(const ObjectFactor& factor) {
  return makeRelativePoseCost(factor.Z, factor.W.matrix());
}

}  // namespace diorama
