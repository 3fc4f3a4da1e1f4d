#include "app/pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/fakes.h"

namespace diorama {
namespace {

using test::FakeOdometry;
using test::FakeTracker;

constexpr int64_t kStep_ns = 33'000'000;

Frame frameAt(int index) { return {index, index * kStep_ns, {}, Image<uint8_t>(4, 4)}; }

SE3 poseAt(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

std::unique_ptr<Odometry> stepsOf(double x, double sigma = 1e-3) {
  return std::make_unique<FakeOdometry>(SE3{Eigen::Quaterniond::Identity(), {x, 0, 0}}, sigma);
}

PipelineParts partsOf(Method method, std::vector<PipelineObject> objects,
                      std::unique_ptr<Odometry> odometry,
                      std::unique_ptr<ObjectDetector> detector = nullptr,
                      const PipelineOptions& options = {}) {
  PipelineParts parts;
  parts.method = method;
  parts.objects = std::move(objects);
  parts.odometry = std::move(odometry);
  parts.detector = std::move(detector);
  parts.options = options;
  return parts;
}

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
  rig.pipeline = std::make_unique<Pipeline>(partsOf(method, std::move(objects), stepsOf(-0.01)));
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
  for (int k = 0; k < 5; ++k) result = rig.pipeline->process(frameAt(k)).at(0);
  ASSERT_TRUE(result.objects[0].T_camera_object.has_value());
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.04, 1e-4);
  ASSERT_TRUE(rig.tracker->starts[4].has_value());
  EXPECT_NEAR(rig.tracker->starts[4]->translation.x(), 0.04, 1e-4);
  EXPECT_FALSE(rig.tracker->starts[3].has_value());

  result = rig.pipeline->process(frameAt(5)).at(0);
  bool found_again = false;
  for (const Event& event : result.events) found_again |= event.event == "reinitialised";
  EXPECT_TRUE(found_again);
}

// The tracker sees the object 1 mm more to the side than the odometry says: the map's world and the
// odometry's go apart, and the one in the other is where the camera is in both.
TEST(Pipeline, TheOdometrysWorldDriftsInTheMaps) {
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return poseAt(0.011 * k); }, std::vector<bool>(20, true));
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), poseAt(0)});
  Pipeline pipeline(partsOf(Method::kFused, std::move(objects), stepsOf(-0.01, 0.01)));
  FrameResult result;
  for (int k = 0; k < 20; ++k) result = pipeline.process(frameAt(k)).at(0);
  ASSERT_TRUE(result.T_world_odometry.has_value());
  const SE3 T_odometry_camera{Eigen::Quaterniond::Identity(), {-0.19, 0, 0}};
  EXPECT_NEAR(((*result.T_world_odometry * T_odometry_camera).translation -
               result.T_world_camera->translation)
                  .norm(),
              0, 1e-9);
  EXPECT_NEAR(result.T_world_odometry->translation.x(), -0.019, 2e-3);
}

TEST(Pipeline, TrackerAloneReportsClaimedFramesOnlyAndGetsNoFeedback) {
  Rig rig = makeRig(Method::kEbt, {true, false, true});
  std::vector<bool> reported;
  for (int k = 0; k < 3; ++k) {
    const FrameResult result = rig.pipeline->process(frameAt(k)).at(0);
    reported.push_back(result.objects[0].T_camera_object.has_value());
    EXPECT_FALSE(result.T_world_camera.has_value());
  }
  EXPECT_EQ(reported, (std::vector<bool>{true, false, true}));
  EXPECT_FALSE(rig.tracker->starts[2].has_value());
}

TEST(Pipeline, OdometryAloneCarriesTheObjectFromItsInitialPose) {
  Rig rig = makeRig(Method::kVo, {});
  FrameResult result;
  for (int k = 0; k < 4; ++k) result = rig.pipeline->process(frameAt(k)).at(0);
  EXPECT_NEAR(result.T_world_camera->translation.x(), -0.03, 1e-12);
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.03, 1e-12);
  EXPECT_FALSE(result.objects[0].measurement.has_value());
  const FinalEstimate final = rig.pipeline->finish();
  EXPECT_EQ(final.camera.poses.size(), 4u);
  ASSERT_EQ(final.map.objects.size(), 1u);
}

TEST(Pipeline, FusedSurvivesAFrameWithoutOdometry) {
  Rig rig = makeRig(Method::kFused, {true, true, true, true});
  rig.pipeline->process(frameAt(0));
  rig.pipeline->process(frameAt(1));
  const FrameResult result = rig.pipeline->process(frameAt(FakeOdometry::kFailAt)).at(0);
  bool lost = false;
  for (const Event& event : result.events)
    lost |= event.source == "odometry" && event.event == "lost";
  EXPECT_TRUE(lost);
  ASSERT_TRUE(result.objects[0].T_camera_object.has_value());
}

// A detector that finds the box in the frames that it is told, at poseAt(0.01 * frame).
class FakeDetector : public ObjectDetector {
 public:
  explicit FakeDetector(std::vector<int> finds) : finds_(std::move(finds)) {}

  std::vector<std::optional<Detection>> detect(const Frame& frame,
                                               std::span<const int> objects) override {
    searched.push_back(frame.index);
    std::vector<std::optional<Detection>> found(objects.size());
    if (std::find(finds_.begin(), finds_.end(), frame.index) != finds_.end())
      found.at(0) = Detection{poseAt(0.01 * frame.index), 0.9, 0.9, 12};
    return found;
  }

  std::vector<int> searched;

 private:
  std::vector<int> finds_;
};

struct DetectRig : Rig {
  FakeDetector* detector = nullptr;
};

DetectRig makeDetectRig(Method method, std::vector<bool> claims, std::vector<int> finds,
                        const PipelineOptions& options = {}) {
  DetectRig rig;
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return poseAt(0.01 * k); }, std::move(claims));
  auto detector = std::make_unique<FakeDetector>(std::move(finds));
  rig.tracker = tracker.get();
  rig.detector = detector.get();
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), std::nullopt});
  rig.pipeline = std::make_unique<Pipeline>(
      partsOf(method, std::move(objects), stepsOf(-0.01), std::move(detector), options));
  return rig;
}

std::vector<std::string> eventsOf(Pipeline& pipeline, int frames) {
  std::vector<std::string> events;
  for (int k = 0; k < frames; ++k)
    for (const FrameResult& result : pipeline.process(frameAt(k)))
      for (const Event& event : result.events) events.push_back(event.event);
  return events;
}

TEST(PipelineDetection, StartsTheTrackerWhereTheObjectIsFound) {
  DetectRig rig = makeDetectRig(Method::kEbt, {false, false, true, true}, {2});
  EXPECT_EQ(eventsOf(*rig.pipeline, 4),
            (std::vector<std::string>{"started", "detected", "tracked"}));
  EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 1, 2}));
  EXPECT_FALSE(rig.tracker->starts[1].has_value());
  ASSERT_TRUE(rig.tracker->starts[2].has_value());
  EXPECT_NEAR(rig.tracker->starts[2]->translation.x(), 0.02, 1e-12);
  EXPECT_FALSE(rig.tracker->starts[3].has_value());
}

TEST(PipelineDetection, TrackerAloneLooksForALostObject) {
  DetectRig rig = makeDetectRig(Method::kEbt, {true, false, false, true}, {0, 3});
  EXPECT_EQ(eventsOf(*rig.pipeline, 4),
            (std::vector<std::string>{"detected", "started", "tracked", "lost", "detected",
                                      "reinitialised"}));
  EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 2, 3}));
}

TEST(PipelineDetection, FusedTriesTheGraphFirstAndSearchesWhenThatLeadsToNothing) {
  PipelineOptions options;
  options.redetect_after_frames = 2;
  DetectRig rig =
      makeDetectRig(Method::kFused, {true, true, false, false, false, true}, {0, 5}, options);
  eventsOf(*rig.pipeline, 6);
  EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 4, 5}));
  for (const int k : {3, 4, 5})
    EXPECT_TRUE(rig.tracker->starts[static_cast<size_t>(k)].has_value()) << k;
}

TEST(PipelineDetection, SearchesEveryNthFrameOnly) {
  PipelineOptions options;
  options.search_every_frames = 3;
  DetectRig rig = makeDetectRig(Method::kEbt, {}, {}, options);
  eventsOf(*rig.pipeline, 8);
  EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 3, 6}));
}

TEST(PipelineDetection, OdometryAloneCarriesTheObjectFromWhereItWasFound) {
  DetectRig rig = makeDetectRig(Method::kVo, {}, {2});
  FrameResult result;
  for (int k = 0; k < 2; ++k) result = rig.pipeline->process(frameAt(k)).at(0);
  EXPECT_FALSE(result.objects[0].T_camera_object.has_value());
  for (int k = 2; k < 5; ++k) result = rig.pipeline->process(frameAt(k)).at(0);
  ASSERT_TRUE(result.objects[0].T_camera_object.has_value());
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.04, 1e-12);
  EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(rig.pipeline->finish().map.objects.size(), 1u);
}

// A tracker that slips to something beside the object keeps its claim; the graph knows better.
Rig makeSlippingRig(int from, double by_m, std::vector<bool> claims) {
  Rig rig;
  auto tracker = std::make_unique<FakeTracker>(
      "box",
      [from, by_m](int k) {
        // Nowhere the same in the world, so that it makes no place of its own.
        const double off = k < from ? 0 : by_m * (1 + 0.5 * (k - from));
        return poseAt(0.01 * k + off);
      },
      std::move(claims));
  rig.tracker = tracker.get();
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), poseAt(0)});
  rig.pipeline =
      std::make_unique<Pipeline>(partsOf(Method::kFused, std::move(objects), stepsOf(-0.01)));
  return rig;
}

TEST(PipelineFeedback, RejectedMeasurementsDoNotMoveTheMapAndResetTheTracker) {
  Rig rig = makeSlippingRig(5, 0.1, std::vector<bool>(12, true));
  FrameResult result;
  int rejected = 0, resets = 0;
  for (int k = 0; k < 12; ++k) {
    result = rig.pipeline->process(frameAt(k)).at(0);
    for (const Event& event : result.events) {
      rejected += event.event == "rejected";
      resets += event.event == "reset";
      if (event.event == "rejected") {
        EXPECT_GT(event.value, 22.46);
      }
    }
  }
  EXPECT_EQ(rejected, 7);
  EXPECT_EQ(resets, 4);  // from the third rejection on
  EXPECT_FALSE(rig.tracker->starts[7].has_value());
  ASSERT_TRUE(rig.tracker->starts[8].has_value());
  EXPECT_NEAR(rig.tracker->starts[8]->translation.x(), 0.08, 5e-3);
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.11, 5e-3);
}

TEST(PipelineFeedback, CountersAreFramesOrSeconds) {
  for (const bool by_time : {false, true}) {
    PipelineOptions options;
    options.redetect_after_frames = by_time ? 1000 : 4;
    options.redetect_after_s = by_time ? 0.13 : 1000;  // four frames of 33 ms
    DetectRig rig = makeDetectRig(Method::kFused, {true, true}, {0}, options);
    const std::vector<std::string> events = eventsOf(*rig.pipeline, 9);
    EXPECT_EQ(rig.detector->searched, (std::vector<int>{0, 6, 7, 8})) << by_time;
    // The tracker's own, and once that of the counter.
    EXPECT_EQ(std::count(events.begin(), events.end(), "lost"), 2) << by_time;
  }
}

// The object was moved while nobody saw it: found elsewhere by detection, it is believed again.
TEST(PipelineFeedback, AnObjectFoundElsewhereAfterTheCounterHasANewPlace) {
  std::vector<bool> claims(40, true);
  for (size_t k = 20; k < 30; ++k) claims[k] = false;
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return poseAt(0.01 * k + (k < 20 ? 0 : 0.3)); }, std::move(claims));
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), std::nullopt});
  PipelineOptions options;
  options.redetect_after_frames = 5;
  Pipeline pipeline(partsOf(Method::kFused, std::move(objects), stepsOf(-0.01),
                            std::make_unique<FakeDetector>(std::vector<int>{0, 30}), options));
  FrameResult result;
  for (int k = 0; k < 40; ++k) result = pipeline.process(frameAt(k)).at(0);
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.39 + 0.3, 5e-3);
}

TEST(PipelineFeedback, AnObjectThatMovesTellsNeitherOdometryNorMapOfTheCamera) {
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return poseAt(0.01 * k + 0.01 * std::max(0, k - 30)); },
      std::vector<bool>(60, true));
  std::vector<PipelineObject> objects;
  objects.push_back({"box", std::move(tracker), poseAt(0)});
  auto odometry = stepsOf(-0.01, 1e-4);
  const FakeOdometry& told = static_cast<FakeOdometry&>(*odometry);
  Pipeline pipeline(partsOf(Method::kFused, std::move(objects), std::move(odometry)));
  int moving = 0;
  FrameResult result;
  for (int k = 0; k < 60; ++k) {
    result = pipeline.process(frameAt(k)).at(0);
    for (const Event& event : result.events) moving += event.event == "moving";
  }
  EXPECT_EQ(moving, 1);
  EXPECT_EQ(told.told[29], 1u);
  EXPECT_EQ(told.told[59], 0u);
  EXPECT_NEAR(result.T_world_camera->translation.x(), -0.59, 1e-3);
  EXPECT_NEAR(result.objects[0].T_camera_object->translation.x(), 0.59 + 0.29, 5e-3);
}

// One object tells where the camera is, and that where the other one is.
TEST(PipelineFeedback, OneObjectHelpsToFindTheOther) {
  auto first = std::make_unique<FakeTracker>(
      "a", [](int k) { return poseAt(0.01 * k); }, std::vector<bool>(30, true));
  std::vector<bool> claims(30, false);
  std::fill(claims.begin(), claims.begin() + 10, true);
  auto second = std::make_unique<FakeTracker>(
      "b", [](int k) { return poseAt(0.01 * k + 0.2); }, std::move(claims));
  FakeTracker* lost = second.get();
  std::vector<PipelineObject> objects;
  objects.push_back({"a", std::move(first), poseAt(0)});
  objects.push_back({"b", std::move(second), poseAt(0.2)});
  // The odometry says that the camera stands still, and that it is not sure of it.
  Pipeline pipeline(partsOf(Method::kFused, std::move(objects), stepsOf(0, 0.02)));
  for (int k = 0; k < 30; ++k) pipeline.process(frameAt(k));
  ASSERT_TRUE(lost->starts[29].has_value());
  // Of this frame, not of the one before: the camera has moved by 1 cm since.
  EXPECT_NEAR(lost->starts[29]->translation.x(), 0.29 + 0.2, 2e-3);
}

}  // namespace
}  // namespace diorama
