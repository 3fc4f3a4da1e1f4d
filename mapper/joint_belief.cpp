#include "mapper/joint_belief.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace diorama {

JointBelief::JointBelief(RootSystem::Solution solution, bool camera_is_fixed)
    : delta_(std::move(solution.delta)), P_(std::move(solution.P)) {
  if (!camera_is_fixed) return;
  delta_.head<6>().setZero();
  P_.topRows<6>().setZero();
  P_.leftCols<6>().setZero();
}

bool JointBelief::isSound() const {
  return delta_.allFinite() && (P_.diagonal().array() >= 0).all();
}

// From r + J_a delta_a + J_s s + J_b delta_b = w with white w:
//   delta_b = F delta_a + K s + G (w - r).
void JointBelief::advance(const ChartStep& odometry, std::optional<Eigen::Index> scale) {
  const Matrix6d G = odometry.J_b.partialPivLu().inverse();
  const Matrix6d F = -G * odometry.J_a;
  const Eigen::Index objects = P_.rows() - 6;
  const Vector6d camera = delta_.head<6>();
  delta_.head<6>() = F * camera - G * odometry.r;
  const Matrix6d P = P_.topLeftCorner<6, 6>();
  P_.topLeftCorner<6, 6>() = F * P * F.transpose() + G * G.transpose();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> cross = P_.topRightCorner(6, objects);
  P_.topRightCorner(6, objects).noalias() = F * cross;
  if (scale) {
    const Vector6d K = -G * odometry.J_scale;
    delta_.head<6>() += K * delta_[*scale];
    const Matrix6d with_camera = P_.block<6, 1>(0, *scale) * K.transpose();
    P_.topLeftCorner<6, 6>() += with_camera + with_camera.transpose();
    P_.topLeftCorner<6, 6>() += P_(*scale, *scale) * K * K.transpose();
    P_.topRightCorner(6, objects) += K * P_.row(*scale).tail(objects);
  }
  P_.bottomLeftCorner(objects, 6) = P_.topRightCorner(6, objects).transpose();
}

JointBelief::Gain JointBelief::gainOf(const ChartPair& pair, Eigen::Index at) const {
  Gain gain;
  gain.PHt.noalias() = P_.leftCols<6>() * pair.J_a.transpose();
  gain.PHt.noalias() += P_.middleCols<6>(at) * pair.J_b.transpose();
  gain.S = Matrix6d::Identity();
  gain.S.noalias() += pair.J_a * gain.PHt.topRows<6>();
  gain.S.noalias() += pair.J_b * gain.PHt.middleRows<6>(at);
  gain.nu = pair.r + pair.J_a * delta_.head<6>() + pair.J_b * delta_.segment<6>(at);
  return gain;
}

double JointBelief::innovation(const ChartPair& pair, Eigen::Index at) const {
  const Gain gain = gainOf(pair, at);
  return gain.nu.dot(gain.S.ldlt().solve(gain.nu));
}

void JointBelief::absorb(const ChartPair& pair, Eigen::Index at) {
  Gain gain = gainOf(pair, at);
  const Eigen::LLT<Matrix6d> llt(gain.S);  // at least the identity
  divideByTranspose(gain.PHt, llt.matrixLLT());
  delta_.noalias() -= gain.PHt.lazyProduct(Vector6d(llt.matrixL().solve(gain.nu)));
  subtractSquare(P_, gain.PHt);
}

}  // namespace diorama
