// How an object that is followed has moved so far, and where it is expected next.
#pragma once

#include <cstdint>
#include <optional>

#include "tracker/motion_filter.h"
#include "tracker/pose_refiner.h"

namespace diorama {

class FollowedMotion {
 public:
  // After a longer gap the old velocity says nothing.
  static constexpr double kLongestExtrapolation_s = 0.5;

  // Since the last estimate; 0 for times before it.
  double secondsSince(int64_t timestamp_ns) const;

  // Nothing while the motion is unknown.
  std::optional<PosePrior> expectedAt(int64_t timestamp_ns) const;

  // The pose expected; the last one while the motion is unknown.
  SE3 predict(int64_t timestamp_ns, const SE3& last) const {
    const auto expected = expectedAt(timestamp_ns);
    return expected ? expected->T_camera_model : last;
  }

  // The motion goes on from an estimate that is good, and is unknown after another.
  void learn(const Estimate& estimate, int64_t timestamp_ns, bool good);
  void stop() { filter_.stop(); }

 private:
  MotionFilter filter_;
  int64_t last_ns_ = 0;
};

}  // namespace diorama
