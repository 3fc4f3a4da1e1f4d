#include "vo/motion_model.h"

#include <algorithm>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr size_t kPoses = 6;
constexpr int kFewestLearnt = 10;
constexpr int kMemory = 30;    // frames
constexpr double kSafety = 2;  // what comes may be rougher than what was
// m^2/s^3: a camera that has been at rest may start to move.
constexpr double kLeastStrength = 0.01;

double seconds(int64_t from_ns, int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

}  // namespace

void MotionModel::add(int64_t timestamp_ns, const SE3& T_world_camera, bool certain) {
  if (!last_.empty() && seconds(last_.back().timestamp_ns, timestamp_ns) > kSameMotion_s)
    forgetMotion();
  last_.push_back({timestamp_ns, T_world_camera, certain});
  if (last_.size() > kPoses) last_.pop_front();
  if (last_.size() < 3) return;
  const Pose &a = *(last_.end() - 3), &b = *(last_.end() - 2), &c = last_.back();
  if (!a.certain || !b.certain || !c.certain) return;
  const double d1 = seconds(a.timestamp_ns, b.timestamp_ns);
  const double d2 = seconds(b.timestamp_ns, c.timestamp_ns);
  const Vector3d change = (c.T_world_camera.translation - b.T_world_camera.translation) / d2 -
                          (b.T_world_camera.translation - a.T_world_camera.translation) / d1;
  const double q = change.squaredNorm() / (3 * velocityChangeVariance(1, d1, d2));  // three axes
  learnt_ = std::min(learnt_ + 1, kMemory);
  strength_ += (q - strength_) / learnt_;
}

std::optional<double> MotionModel::strength() const {
  if (learnt_ < kFewestLearnt) return std::nullopt;
  return std::max(kLeastStrength, kSafety * strength_);
}

std::optional<PositionPrior> MotionModel::predict(int64_t timestamp_ns) const {
  if (last_.size() < 2 || !strength()) return std::nullopt;
  const Pose &a = last_[last_.size() - 2], &b = last_.back();
  const double d1 = seconds(a.timestamp_ns, b.timestamp_ns),
               d2 = seconds(b.timestamp_ns, timestamp_ns);
  if (!(d2 > 0 && d2 < kSameMotion_s)) return std::nullopt;
  const Vector3d &from = a.T_world_camera.translation, &to = b.T_world_camera.translation;
  return PositionPrior{to + d2 / d1 * (to - from),
                       d2 * d2 * velocityChangeVariance(*strength(), d1, d2)};
}

// The mean twist of the last poses, for a time that its decay leaves.
SE3 MotionModel::coast(int64_t from_ns, int64_t to_ns) const {
  if (last_.size() < 2) return {};
  constexpr double kDecay_s = 1;
  const Pose &first = last_.front(), &last = last_.back();
  const auto gone = [&](int64_t t_ns) {
    return kDecay_s * (1 - std::exp(-seconds(last.timestamp_ns, t_ns) / kDecay_s));
  };
  const double share =
      (gone(to_ns) - gone(from_ns)) / seconds(first.timestamp_ns, last.timestamp_ns);
  return exp(share * log(first.T_world_camera.inverse() * last.T_world_camera));
}

void MotionModel::forgetMotion() { last_.clear(); }

void MotionModel::stretch(double factor) {
  last_.clear();
  strength_ *= factor * factor;
}

// The path keeps its shape.
void MotionModel::moveTo(const SE3& T_world_camera) {
  if (last_.empty()) return;
  const Vector3d by = T_world_camera.translation - last_.back().T_world_camera.translation;
  for (Pose& pose : last_) pose.T_world_camera.translation += by;
}

}  // namespace diorama::vo
