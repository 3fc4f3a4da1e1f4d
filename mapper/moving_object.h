// The poses of an object that moves: a chain of its own, from one measured frame to the next, with
// constant velocity between them. A Kalman filter on SE(3) over pose and velocity; the camera's
// poses are given, and learn nothing from it.
//   T(t + dt) = T(t) Exp(v dt),  v(t + dt) = v(t) + w,  w white acceleration
#pragma once

#include <cstdint>

#include "mapper/motion_watch.h"

namespace diorama {

class MovingObject {
 public:
  // At rest, with a velocity that is not known.
  MovingObject(const MotionOptions& options, int64_t timestamp_ns, const SE3& T_world_object,
               const Matrix6d& covariance);

  // A measured pose and its covariance, not older than the last one. Its normalised innovation;
  // one of `limit` or more changes nothing.
  double absorb(int64_t timestamp_ns, const SE3& T_world_object, const Matrix6d& covariance,
                double limit);

  struct Place {
    SE3 T_world_object;
    Matrix6d covariance;  // right tangent
  };
  // Where it is, or will be when nobody sees it until then.
  Place at(int64_t timestamp_ns) const;
  int64_t timestamp_ns() const { return timestamp_ns_; }
  double speed_m_s() const { return velocity_.head<3>().norm(); }

  // The world is another one now.
  void carry(const SE3& T_new_old) { T_world_object_ = T_new_old * T_world_object_; }

 private:
  using Matrix12d = Eigen::Matrix<double, 12, 12>;
  void propagate(int64_t timestamp_ns);

  MotionOptions options_;
  int64_t timestamp_ns_;
  SE3 T_world_object_;
  Vector6d velocity_ = Vector6d::Zero();  // in its own frame, 1/s
  Matrix12d P_;                           // of pose and velocity
};

}  // namespace diorama
