// The pose of something that moves while the rows of a frame are exposed one after the other.
#pragma once

#include <functional>
#include <vector>

#include "core/se3.h"

namespace diorama {

class RowPoses {
 public:
  // `pose` is a function of the seconds from the frame's timestamp. Poses are exact at the rows of
  // the image and one height to both sides, and geodesic between two rows.
  RowPoses(const std::function<SE3(double)>& pose, double row_time_s, int height);

  bool rolling() const { return poses_.size() > 1; }
  SE3 at(double row) const;

 private:
  double first_row_ = 0;
  std::vector<SE3> poses_;
  std::vector<Vector6d> steps_;  // poses_[i + 1] = poses_[i] * exp(steps_[i])
};

}  // namespace diorama
