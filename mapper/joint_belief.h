// Mean and covariance of the newest camera pose and the objects in use, in the charts of a
// RootSystem and in its order. It follows from the root; between two solutions of the root it is
// carried on by the same measurements in covariance form, which costs little for each.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "mapper/root_system.h"

namespace diorama {

class JointBelief {
 public:
  JointBelief() = default;
  explicit JointBelief(RootSystem::Solution solution, bool camera_is_fixed);

  const Eigen::VectorXd& delta() const { return delta_; }
  const Eigen::MatrixXd& P() const { return P_; }

  // False when rounding has spoilt it, as it does where covariances of all sizes meet: then it is
  // to be made anew from the root.
  bool isSound() const;

  // The camera moves on; the residual is white. Where the block of its scale is, if it has one.
  void advance(const ChartStep& odometry, std::optional<Eigen::Index> scale);

  // Squared length of the innovation of a white residual between the camera and the block at
  // `at`: nu^T S^-1 nu with S = I + H P H^T. Chi-square with 6 degrees of freedom when all is
  // well.
  double innovation(const ChartPair& pair, Eigen::Index at) const;

  // The measurement is believed (a Kalman update).
  void absorb(const ChartPair& pair, Eigen::Index at);

 private:
  struct Gain {
    Columns6d PHt;
    Matrix6d S;
    Vector6d nu;
  };
  Gain gainOf(const ChartPair& pair, Eigen::Index at) const;

  Eigen::VectorXd delta_ = Vector6d::Zero();
  Eigen::MatrixXd P_ = Matrix6d::Zero();
};

}  // namespace diorama
