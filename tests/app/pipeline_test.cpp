#include "app/pipeline.h"

#include <gtest/gtest.h>

#include "tests/support/fakes.h"

namespace diorama {
namespace {

using test::FakeOdometry;
using test::FakeTracker;

constexpr int64_t kStep_ns = 33'000'000;

Frame frameAt(int index) { return {index, index * kStep_ns, {}, Image<uint8_t>(4, 4)}; }

SE3 poseAt(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

struct Rig {
  FakeTracker* tracker = nullptr;
  std::unique_ptr<Pipeline> pipeline;
};

// The camera moves by -1 cm in x per frame, so that the object moves by +1 cm in the image's frame.
Rig makeRig(Method method, std::vector<bool> claims) {
  Rig rig;
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return poseAt(0.01 * k); }, std::move(claims));
  rig.tracker = tracker.get();
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), poseAt(0)});
  auto odometry =
      std::make_unique<FakeOdometry>(SE3{Eigen::Quaterniond::Identity(), {-0.01, 0, 0}});
  rig.pipeline =
      std::make_unique<Pipeline>(method, std::move(objects), std::move(odometry), MapperOptions{});
  return rig;
}

TEST(Pipeline, StartsTheTrackerFromTheInitialPoseOnly) {
  Rig rig = makeRig(Method::kFused, {true, true, true});
  for (int k = 0; k < 3; ++k) rig.pipeline->process(frameAt(k));
  ASSERT_EQ(rig.tracker->starts.size(), 3u);
  EXPECT_TRUE(rig.tracker->starts[0].has_value());
  EXPECT_FALSE(rig.tracker->starts[1].has_value());
  EXPECT_FALSE(rig.tracker->starts[2].has_value());
}

TEST(Pipeline, FusedCarriesALostObjectAndReseedsTheTracker) {
  Rig rig = makeRig(Method::kFused, {true, true, true, false, false, true});
  FrameResult result;
  for (int k = 0; k < 5; ++k) result = rig.pipeline->process(frameAt(k));
  ASSERT_TRUE(result.objects[0].T_camera_object.has_value());
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.04, 1e-4);
  ASSERT_TRUE(rig.tracker->starts[4].has_value());
  EXPECT_NEAR(rig.tracker->starts[4]->translation.x(), 0.04, 1e-4);
  EXPECT_FALSE(rig.tracker->starts[3].has_value());

  result = rig.pipeline->process(frameAt(5));
  bool found_again = false;
  for (const Event& event : result.events) found_again |= event.event == "reinitialised";
  EXPECT_TRUE(found_again);
}

TEST(Pipeline, TrackerAloneReportsClaimedFramesOnlyAndGetsNoFeedback) {
  Rig rig = makeRig(Method::kEbt, {true, false, true});
  std::vector<bool> reported;
  for (int k = 0; k < 3; ++k) {
    const FrameResult result = rig.pipeline->process(frameAt(k));
    reported.push_back(result.objects[0].T_camera_object.has_value());
    EXPECT_FALSE(result.T_world_camera.has_value());
  }
  EXPECT_EQ(reported, (std::vector<bool>{true, false, true}));
  EXPECT_FALSE(rig.tracker->starts[2].has_value());
}

TEST(Pipeline, OdometryAloneCarriesTheObjectFromItsInitialPose) {
  Rig rig = makeRig(Method::kVo, {});
  FrameResult result;
  for (int k = 0; k < 4; ++k) result = rig.pipeline->process(frameAt(k));
  EXPECT_NEAR(result.T_world_camera->translation.x(), -0.03, 1e-12);
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.03, 1e-12);
  EXPECT_FALSE(result.objects[0].measurement.has_value());
  const Pipeline::Final final = rig.pipeline->finish();
  EXPECT_EQ(final.camera.poses.size(), 4u);
  ASSERT_EQ(final.map.objects.size(), 1u);
}

TEST(Pipeline, FusedSurvivesAFrameWithoutOdometry) {
  Rig rig = makeRig(Method::kFused, {true, true, true, true});
  rig.pipeline->process(frameAt(0));
  rig.pipeline->process(frameAt(1));
  const FrameResult result = rig.pipeline->process(frameAt(FakeOdometry::kFailAt));
  bool lost = false;
  for (const Event& event : result.events)
    lost |= event.source == "odometry" && event.event == "lost";
  EXPECT_TRUE(lost);
  ASSERT_TRUE(result.objects[0].T_camera_object.has_value());
}

}  // namespace
}  // namespace diorama
