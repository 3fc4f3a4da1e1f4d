#include "mapper/odometry_factor.h"

#include <ceres/sized_cost_function.h>

#include <cmath>

#include "mapper/se3_manifold.h"

namespace diorama {

OdometryFactorResult makeOdometryFactor(const OdometryMeasurement& m, double sigma_scale) {
  if (!(m.health > 0)) return {std::nullopt, "no measurement (health 0)"};
  if (!isUnitPose(m.T_from_to)) return {std::nullopt, "the pose is not finite, or no rotation"};
  Vector6d widths = Vector6d::Constant(sigma_scale);
  if (m.up_to_scale) widths.head<3>() *= std::exp(kUnknownScale);
  const std::optional<Whitening> W =
      whitening(widths.asDiagonal() * m.covariance * widths.asDiagonal());
  if (!W) return {std::nullopt, "the covariance is not finite or not positive definite"};
  return {OdometryFactor{m.T_from_to, *W}, ""};
}

OdometryFactor makeGapFactor(double seconds, double sigma_m_s, double sigma_rad_s) {
  Vector6d w;
  w << Vector3d::Constant(1 / (sigma_m_s * seconds)),
      Vector3d::Constant(1 / (sigma_rad_s * seconds));
  return {SE3{}, Whitening(w.asDiagonal())};
}

SE3 scaled(const SE3& Z, double s) { return {Z.rotation, std::exp(s) * Z.translation}; }

// Z(s + ds) = Z(s) Exp([R^T t ds, 0]) with the scaled t, and Log(Exp(-e) T) = Log(T) - Jl^-1 e.
LinearisedStep linearise(const OdometryFactor& factor, const RobustKernel& kernel,
                         const SE3& T_world_from, const SE3& T_world_to, double s) {
  const SE3 Z = scaled(factor.Z, s);
  const LinearisedPair pair = linearise(Z, T_world_from, T_world_to);
  Vector6d longer = Vector6d::Zero();
  longer.head<3>() = Z.rotation.conjugate() * Z.translation;
  const Vector6d J_scale = -rightJacobianInverse(-pair.r) * longer;
  const Matrix6d W = factor.W.matrix();
  return {whitened(pair, W, kernel), rootWeight(pair.r, W, kernel) * (W * J_scale)};
}

namespace {

class ScaledStepCost final : public ceres::SizedCostFunction<6, 7, 7, 7> {
 public:
  explicit ScaledStepCost(const OdometryFactor& factor) : factor_(factor) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const SE3 T_world_from = fromBlock(blocks[0]), T_world_to = fromBlock(blocks[1]);
    const LinearisedStep step = linearise(factor_, {}, T_world_from, T_world_to, blocks[2][0]);
    Eigen::Map<Vector6d>{residuals} = step.r;
    if (!jacobians) return true;
    if (jacobians[0]) Eigen::Map<Matrix67d>{jacobians[0]} = step.J_a * tangentByBlock(T_world_from);
    if (jacobians[1]) Eigen::Map<Matrix67d>{jacobians[1]} = step.J_b * tangentByBlock(T_world_to);
    if (jacobians[2]) {
      Eigen::Map<Matrix67d> by_scale{jacobians[2]};
      by_scale.setZero();
      by_scale.col(0) = step.J_scale;
    }
    return true;
  }

 private:
  OdometryFactor factor_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> makeCost(const OdometryFactor& factor) {
  if (factor.scale) return std::make_unique<ScaledStepCost>(factor);
  return makeRelativePoseCost(factor.Z, factor.W.matrix());
}

}  // namespace diorama
