#include "tracker/followed_motion.h"

#include <algorithm>

namespace diorama {

double FollowedMotion::secondsSince(int64_t timestamp_ns) const {
  return std::max(0.0, 1e-9 * static_cast<double>(timestamp_ns - last_ns_));
}

std::optional<PosePrior> FollowedMotion::expectedAt(int64_t timestamp_ns) const {
  const double seconds = secondsSince(timestamp_ns);
  if (!filter_.started() || seconds > kLongestExtrapolation_s) return std::nullopt;
  return filter_.predict(seconds);
}

void FollowedMotion::learn(const Estimate& estimate, int64_t timestamp_ns, bool good) {
  const double seconds = secondsSince(timestamp_ns);
  last_ns_ = timestamp_ns;
  if (!good)
    filter_.stop();
  else if (!filter_.started() || !(seconds > 0) || seconds > kLongestExtrapolation_s)
    filter_.start(estimate.T_camera_model, estimate.covariance);
  else if (estimate.by_prediction)
    filter_.correct(seconds, estimate.T_camera_model, estimate.by_image);
  else
    filter_.jump(seconds, estimate.T_camera_model, estimate.covariance);
}

}  // namespace diorama
