#include "mapper/relative_pose.h"

#include <ceres/sized_cost_function.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>

#include "mapper/se3_manifold.h"

namespace diorama {
namespace {

class RelativePoseCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  RelativePoseCost(const SE3& Z, const Matrix6d& W) : Z_(Z), W_(W) {}

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const SE3 T_world_a = fromBlock(blocks[0]), T_world_b = fromBlock(blocks[1]);
    const LinearisedPair pair = linearise(Z_, T_world_a, T_world_b);
    Eigen::Map<Vector6d>{residuals} = W_ * pair.r;
    if (!jacobians) return true;
    if (jacobians[0])
      Eigen::Map<Matrix67d>{jacobians[0]} = W_ * pair.J_a * tangentByBlock(T_world_a);
    if (jacobians[1])
      Eigen::Map<Matrix67d>{jacobians[1]} = W_ * pair.J_b * tangentByBlock(T_world_b);
    return true;
  }

 private:
  SE3 Z_;
  Matrix6d W_;
};

}  // namespace

Whitening::Whitening(const Matrix6d& W) {
  const Eigen::HouseholderQR<Matrix6d> qr(W);
  size_t k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) {
      const double sign = qr.matrixQR()(i, i) < 0 ? -1 : 1;
      rows_[k++] = static_cast<float>(sign * qr.matrixQR()(i, j));
    }
}

Matrix6d Whitening::matrix() const {
  Matrix6d W = Matrix6d::Zero();
  size_t k = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) W(i, j) = rows_[k++];
  return W;
}

LinearisedPair linearise(const SE3& Z, const SE3& T_world_a, const SE3& T_world_b) {
  const SE3 T_a_b = T_world_a.inverse() * T_world_b;
  const Vector6d r = log(Z.inverse() * T_a_b);
  const Matrix6d J = rightJacobianInverse(r);
  return {r, -J * adjoint(T_a_b.inverse()), J};
}

double rootWeight(const Vector6d& r, const Matrix6d& W, const RobustKernel& kernel) {
  return std::sqrt(kernel((W * r).squaredNorm()).slope);
}

LinearisedPair whitened(const LinearisedPair& pair, const Matrix6d& W, const RobustKernel& kernel) {
  const Vector6d r = W * pair.r;
  const double weight = rootWeight(pair.r, W, kernel);
  return {weight * r, weight * (W * pair.J_a), weight * (W * pair.J_b)};
}

bool isUnitPose(const SE3& pose) {
  return pose.isFinite() && pose.translation.norm() < 1e6 &&
         std::abs(pose.rotation.norm() - 1) < 1e-6;
}

std::optional<Whitening> whitening(const Matrix6d& covariance) {
  if (!covariance.allFinite() || covariance.cwiseAbs().maxCoeff() > 1e12) return std::nullopt;
  const double asymmetry = (covariance - covariance.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-9 * covariance.cwiseAbs().maxCoeff()) return std::nullopt;
  if (Eigen::LLT<Matrix6d>(covariance).info() != Eigen::Success) return std::nullopt;
  const Matrix6d floored = covariance + 1e-12 * Matrix6d::Identity();
  const Eigen::LLT<Matrix6d> llt(floored);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return Whitening(llt.matrixL().solve(Matrix6d::Identity()));
}

std::unique_ptr<ceres::CostFunction> makeRelativePoseCost(const SE3& Z, const Matrix6d& W) {
  return std::make_unique<RelativePoseCost>(Z, W);
}

}  // namespace diorama
