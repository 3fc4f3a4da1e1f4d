#include "mapper/se3_manifold.h"

#include <ceres/manifold.h>

namespace diorama {
namespace {

// q * (0, phi) = Q * phi for a pure quaternion, rows x y z w; Q^T Q = I.
Eigen::Matrix<double, 4, 3> quaternionTimes(const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> Q;
  Q << q.w() * Matrix3d::Identity() + skew(q.vec()), -q.vec().transpose();
  return Q;
}

class SE3Manifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const PoseBlock block = toBlock(fromBlock(x) * exp(Eigen::Map<const Vector6d>(delta)));
    std::copy(block.begin(), block.end(), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Matrix76d> J(jacobian);
    J = blockByTangent(fromBlock(x));
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d> difference(y_minus_x);
    difference = log(fromBlock(x).inverse() * fromBlock(y));
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Matrix67d> J(jacobian);
    J = tangentByBlock(fromBlock(x));
    return true;
  }
};

}  // namespace

PoseBlock toBlock(const SE3& pose) {
  const Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

SE3 fromBlock(const double* block) {
  return {Eigen::Quaterniond(block[6], block[3], block[4], block[5]),
          {block[0], block[1], block[2]}};
}

Matrix76d blockByTangent(const SE3& pose) {
  Matrix76d J = Matrix76d::Zero();
  J.topLeftCorner<3, 3>() = pose.rotationMatrix();
  J.bottomRightCorner<4, 3>() = 0.5 * quaternionTimes(pose.rotation);
  return J;
}

Matrix67d tangentByBlock(const SE3& pose) {
  Matrix67d J = Matrix67d::Zero();
  J.topLeftCorner<3, 3>() = pose.rotationMatrix().transpose();
  J.bottomRightCorner<3, 4>() = 2 * quaternionTimes(pose.rotation).transpose();
  return J;
}

std::unique_ptr<ceres::Manifold> makeSE3Manifold() { return std::make_unique<SE3Manifold>(); }

}  // namespace diorama
