#include "app/odometry_relay.h"

#include <algorithm>

#include "core/errors.h"

namespace diorama {

OdometryRelay::OdometryRelay(std::vector<Runner> runners) : runners_(std::move(runners)) {
  DIORAMA_CHECK(!runners_.empty());
}

std::optional<OdometryMeasurement> OdometryRelay::track(const Frame& frame) {
  now_ns_ = frame.timestamp_ns;
  switched_.reset();
  std::optional<OdometryMeasurement> chosen, failed;
  for (size_t i = 0; i < runners_.size(); ++i) {
    std::optional<OdometryMeasurement> measured = runners_[i].odometry->track(frame);
    if (!measured) continue;
    if (measured->health <= 0 || measured->from_ns != reached_ns_) {
      measured->health = 0;
      if (!failed) failed = std::move(measured);
    } else if (!chosen) {
      chosen = std::move(measured);
      if (leader_ && leader_ != i)
        switched_ = {"switched", static_cast<double>(i), "to " + runners_[i].name};
      leader_ = i;
    }
  }
  if (!chosen) return failed;
  reached_ns_ = now_ns_;
  return chosen;
}

bool OdometryRelay::wantsObjects() const {
  return std::any_of(runners_.begin(), runners_.end(),
                     [](const Runner& runner) { return runner.odometry->wantsObjects(); });
}

void OdometryRelay::leaveOut(std::span<const ObjectMeasurement> moving) {
  for (Runner& runner : runners_) runner.odometry->leaveOut(moving);
}

void OdometryRelay::update(std::span<const ObjectMeasurement> objects) {
  for (Runner& runner : runners_) runner.odometry->update(objects);
  if (!reached_ns_ && started()) reached_ns_ = now_ns_;
}

bool OdometryRelay::started() const {
  return std::any_of(runners_.begin(), runners_.end(),
                     [](const Runner& runner) { return runner.odometry->started(); });
}

std::optional<SE3> OdometryRelay::locate(const std::string& object) const {
  for (const Runner& runner : runners_)
    if (const std::optional<SE3> T_camera_object = runner.odometry->locate(object))
      return T_camera_object;
  return std::nullopt;
}

std::vector<OdometryEvent> OdometryRelay::events() const {
  std::vector<OdometryEvent> all;
  if (switched_) all.push_back(*switched_);
  for (const Runner& runner : runners_)
    for (OdometryEvent event : runner.odometry->events()) {
      event.reason = runner.name + (event.reason.empty() ? "" : ": " + event.reason);
      all.push_back(std::move(event));
    }
  return all;
}

}  // namespace diorama
