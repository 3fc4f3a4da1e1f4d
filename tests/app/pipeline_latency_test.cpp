#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "app/pipeline.h"
#include "tests/support/fakes.h"

namespace diorama {
namespace {

using test::FakeOdometry;
using test::FakeTracker;

constexpr int64_t kStep_ns = 33'333'000;

SE3 shifted(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

struct Outcome {
  std::vector<FrameResult> frames;
  FinalEstimate final;
  std::vector<std::optional<SE3>> starts;
};

// The object moves by 1 cm in the camera's frame from picture to picture.
Outcome runWith(const LatencyOptions& latency, const std::vector<bool>& claims) {
  auto tracker = std::make_unique<FakeTracker>(
      "box", [](int k) { return shifted(0.01 * k); }, claims);
  const FakeTracker& fake = *tracker;
  PipelineParts parts;
  parts.objects.push_back({"box", std::move(tracker), shifted(0)});
  parts.odometry =
      std::make_unique<FakeOdometry>(SE3{Eigen::Quaterniond::Identity(), {-0.01, 0, 0}});
  parts.options.latency_s = latency;
  Pipeline pipeline(std::move(parts));
  Outcome outcome;
  const auto keep = [&](const std::vector<FrameResult>& results) {
    outcome.frames.insert(outcome.frames.end(), results.begin(), results.end());
  };
  for (int k = 0; k < static_cast<int>(claims.size()); ++k)
    keep(pipeline.process({k, k * kStep_ns, {}, Image<uint8_t>(4, 4)}));
  keep(pipeline.drain());
  outcome.final = pipeline.finish();
  outcome.starts = fake.starts;
  return outcome;
}

class PipelineLatency : public ::testing::TestWithParam<LatencyOptions> {};

TEST_P(PipelineLatency, EveryFrameHasOneResultInOrderAndTheSameOneAgain) {
  const std::vector<bool> claims(30, true);
  const Outcome first = runWith(GetParam(), claims), again = runWith(GetParam(), claims);
  ASSERT_EQ(first.frames.size(), claims.size());
  for (size_t k = 0; k < claims.size(); ++k) {
    const FrameResult &a = first.frames[k], &b = again.frames[k];
    EXPECT_EQ(a.timestamp_ns, static_cast<int64_t>(k) * kStep_ns);
    ASSERT_TRUE(a.T_world_camera.has_value());
    EXPECT_EQ(a.T_world_camera->matrix(), b.T_world_camera->matrix());
    ASSERT_TRUE(a.objects[0].measurement.has_value());
    EXPECT_EQ(a.objects[0].measurement->timestamp_ns, a.timestamp_ns);
    EXPECT_NEAR(a.T_world_camera->translation.x(), -0.01 * static_cast<double>(k), 1e-4);
  }
  EXPECT_EQ(first.final.camera.poses.size(), claims.size());
  ASSERT_EQ(first.final.map.objects.size(), 1u);
  EXPECT_NEAR(first.final.map.objects[0].T_world_object.translation.x(), 0, 1e-4);
}

// The newest pose in the map is older than the picture in which the object is looked for.
TEST_P(PipelineLatency, ALostObjectIsExpectedWhereTheCameraHasMovedTo) {
  std::vector<bool> claims(20, true);
  claims[14] = claims[15] = false;
  const Outcome outcome = runWith(GetParam(), claims);
  ASSERT_TRUE(outcome.starts[16].has_value());
  EXPECT_NEAR(outcome.starts[16]->translation.x(), 0.16, 1e-3);
}

std::string nameOf(const ::testing::TestParamInfo<LatencyOptions>& info) {
  const auto ms = [](double seconds) { return std::to_string(std::lround(1e3 * seconds)); };
  return "tracker_" + ms(info.param.tracker) + "_odometry_" + ms(info.param.odometry);
}

INSTANTIATE_TEST_SUITE_P(Milliseconds, PipelineLatency,
                         ::testing::Values(LatencyOptions{0, 0}, LatencyOptions{0.04, 0.01},
                                           LatencyOptions{0, 0.05}, LatencyOptions{0.15, 0.1},
                                           LatencyOptions{0.2, 0}),
                         nameOf);

// Without hindsight: a frame's estimate is as old as what had come.
TEST(PipelineLatencies, AnObjectThatIsMeasuredLateIsReportedLate) {
  const Outcome outcome = runWith({0.04, 0}, std::vector<bool>(5, true));
  EXPECT_FALSE(outcome.frames[0].objects[0].T_camera_object.has_value());
  EXPECT_FALSE(outcome.frames[1].objects[0].T_camera_object.has_value());
  EXPECT_TRUE(outcome.frames[2].objects[0].T_camera_object.has_value());
}

}  // namespace
}  // namespace diorama
