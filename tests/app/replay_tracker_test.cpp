#include "app/replay_tracker.h"

#include <gtest/gtest.h>

namespace diorama {
namespace {

constexpr int64_t kMs = 1'000'000;  // ns

ObjectMeasurement at(int64_t time_ms, const std::string& object, double x) {
  const SE3 pose{Eigen::Quaterniond::Identity(), {x, 0, 1}};
  return {"edge", object, time_ms * kMs, pose, Matrix6d::Identity(), 0.8, true, ""};
}

TEST(ReplayTracker, GivesWhatWasRecordedForItsObject) {
  ReplayTracker tracker({at(10, "box", 1), at(20, "tin", 2), at(30, "box", 3)}, "box", "replay");
  ASSERT_TRUE(tracker.firstPose().has_value());
  EXPECT_EQ(tracker.firstPose()->translation.x(), 1);
  Frame frame;
  frame.timestamp_ns = 30 * kMs + 333;  // as another program rounds
  const ObjectMeasurement found = tracker.track(frame, std::nullopt);
  EXPECT_TRUE(found.claimed);
  EXPECT_EQ(found.T_camera_object.translation.x(), 3);
  EXPECT_EQ(found.source, "replay");
  EXPECT_EQ(found.timestamp_ns, frame.timestamp_ns);
  frame.timestamp_ns = 20 * kMs;  // only another object's
  const ObjectMeasurement none = tracker.track(frame, ObjectPrediction{});
  EXPECT_FALSE(none.claimed);
  EXPECT_FALSE(none.reason.empty());
  EXPECT_EQ(none.object, "box");
  EXPECT_FALSE(ReplayTracker({}, "box", "replay").firstPose());
}

}  // namespace
}  // namespace diorama
