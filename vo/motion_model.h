// How the camera has moved, and where that would have brought it: constant velocity with a random
// walk, whose strength is learnt from the motion itself. It holds what the image does not.
#pragma once

#include <deque>
#include <optional>

#include "core/se3.h"

namespace diorama::vo {

// Poses farther apart than this (s) say nothing of each other's velocity.
constexpr double kSameMotion_s = 0.25;

// Of the difference, along each axis, of the mean velocities over d1 and then d2 seconds, (m/s)^2,
// when the velocity is a random walk of strength q, m^2/s^3.
inline double velocityChangeVariance(double q, double d1_s, double d2_s) {
  return q * (d1_s + d2_s) / 3;
}

// p is N(mean, variance I), of the camera's position in the world, m and m^2.
struct PositionPrior {
  Vector3d mean;
  double variance;
};

class MotionModel {
 public:
  // A pose that was measured; `certain` when it is so good that accelerations can be learnt from
  // it.
  void add(int64_t timestamp_ns, const SE3& T_world_camera, bool certain);
  // Nothing when too little is known yet.
  std::optional<PositionPrior> predict(int64_t timestamp_ns) const;
  // Of the random walk, m^2/s^3 along each axis; nothing while it is not known.
  std::optional<double> strength() const;

  // How the camera goes on when nothing is seen after the last pose: as it did, slowing down.
  SE3 coast(int64_t from_ns, int64_t to_ns) const;

  void forgetMotion();                     // after a jump; the strength stays
  void stretch(double factor);             // all lengths
  void moveTo(const SE3& T_world_camera);  // the newest pose was corrected

 private:
  struct Pose {
    int64_t timestamp_ns;
    SE3 T_world_camera;
    bool certain;
  };
  std::deque<Pose> last_;  // the oldest first
  double strength_ = 0;
  int learnt_ = 0;
};

}  // namespace diorama::vo
