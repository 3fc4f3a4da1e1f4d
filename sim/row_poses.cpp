#include "sim/row_poses.h"

#include <algorithm>
#include <cmath>

namespace diorama {

RowPoses::RowPoses(const std::function<SE3(double)>& pose, double row_time_s, int height) {
  if (row_time_s == 0) {
    poses_ = {pose(0)};
    return;
  }
  first_row_ = -height;
  const double middle = (height - 1) / 2.0;
  for (int y = -height; y < 2 * height; ++y) poses_.push_back(pose(row_time_s * (y - middle)));
  for (size_t i = 0; i + 1 < poses_.size(); ++i)
    steps_.push_back(log(poses_[i].inverse() * poses_[i + 1]));
}

SE3 RowPoses::at(double row) const {
  if (!rolling()) return poses_[0];
  const double from_first = std::clamp(row - first_row_, 0.0, static_cast<double>(steps_.size()));
  const size_t i = std::min(static_cast<size_t>(from_first), steps_.size() - 1);
  const double part = from_first - static_cast<double>(i);
  if (part == 0) return poses_[i];
  return poses_[i] * exp(part * steps_[i]);
}

}  // namespace diorama
