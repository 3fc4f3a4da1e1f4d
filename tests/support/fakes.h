// A tracker and an odometry that say what they are told to say.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/object_tracker.h"
#include "core/odometry.h"

namespace diorama::test {

inline Matrix6d covarianceOf(double sigma) { return sigma * sigma * Matrix6d::Identity(); }

class FakeTracker : public ObjectTracker {
 public:
  // In frame k the object is at pose(k), and claimed as claims[k] says.
  FakeTracker(std::string object, std::function<SE3(int)> pose, std::vector<bool> claims)
      : object_(std::move(object)), pose_(std::move(pose)), claims_(std::move(claims)) {}

  ObjectMeasurement track(const Frame& frame,
                          const std::optional<ObjectPrediction>& start) override {
    const size_t k = starts.size();
    starts.push_back(start ? std::optional(start->T_camera_object) : std::nullopt);
    const bool claimed = k < claims_.size() && claims_[k];
    return {"fake",
            object_,
            frame.timestamp_ns,
            pose_(frame.index),
            covarianceOf(1e-3),
            claimed ? 0.9 : 0.1,
            claimed,
            claimed ? "" : "told so"};
  }

  std::vector<std::optional<SE3>> starts;  // what each call was given

 private:
  std::string object_;
  std::function<SE3(int)> pose_;
  std::vector<bool> claims_;
};

// The same step each frame; none in frame kFailAt.
class FakeOdometry : public Odometry {
 public:
  static constexpr int kFailAt = 100;

  explicit FakeOdometry(const SE3& step, double sigma = 1e-3) : step_(step), sigma_(sigma) {}

  std::optional<OdometryMeasurement> track(const Frame& frame) override {
    const std::optional<int64_t> before = previous_ns_;
    previous_ns_ = frame.timestamp_ns;
    if (!before || frame.index == kFailAt) return std::nullopt;
    return OdometryMeasurement{"fake", *before, frame.timestamp_ns, step_, covarianceOf(sigma_), 1};
  }

  void update(std::span<const ObjectMeasurement> objects) override {
    told.push_back(objects.size());
  }

  std::vector<size_t> told;  // of so many objects in each frame

 private:
  SE3 step_;
  double sigma_;
  std::optional<int64_t> previous_ns_;
};

}  // namespace diorama::test
