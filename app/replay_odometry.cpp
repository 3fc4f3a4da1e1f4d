#include "app/replay_odometry.h"

#include <algorithm>

#include "app/recorded_time.h"

namespace diorama {

ReplayOdometry::ReplayOdometry(std::vector<OdometryMeasurement> steps, std::string source)
    : steps_(std::move(steps)), source_(std::move(source)) {
  std::stable_sort(steps_.begin(), steps_.end(),
                   [](const auto& a, const auto& b) { return a.from_ns < b.from_ns; });
}

std::optional<OdometryMeasurement> ReplayOdometry::track(const Frame& frame) {
  const std::optional<int64_t> from = previous_ns_;
  previous_ns_ = frame.timestamp_ns;
  if (!from) return std::nullopt;

  OdometryMeasurement sum{source_, *from, frame.timestamp_ns, SE3{}, Matrix6d::Zero(), 1};
  int64_t reached = *from;
  auto step = std::lower_bound(steps_.begin(), steps_.end(), reached - kSameTime_ns,
                               [](const auto& s, int64_t time) { return s.from_ns < time; });
  for (; step != steps_.end() && isSameTime(step->from_ns, reached) &&
         step->to_ns <= frame.timestamp_ns + kSameTime_ns;
       ++step) {
    // Right perturbations: T1 exp(e1) T2 exp(e2) = T1 T2 exp(Ad(T2^-1) e1 + e2) to first order.
    const Matrix6d carry = adjoint(step->T_from_to.inverse());
    sum.covariance = carry * sum.covariance * carry.transpose() + step->covariance;
    sum.T_from_to = sum.T_from_to * step->T_from_to;
    sum.health = std::min(sum.health, step->health);
    sum.up_to_scale |= step->up_to_scale;
    reached = step->to_ns;
  }
  if (!isSameTime(reached, frame.timestamp_ns))
    return OdometryMeasurement{source_, *from, frame.timestamp_ns, SE3{}, Matrix6d::Identity(), 0};
  return sum;
}

bool ReplayOdometry::started() const {
  return previous_ns_ && !steps_.empty() && steps_.front().from_ns <= *previous_ns_ + kSameTime_ns;
}

}  // namespace diorama
