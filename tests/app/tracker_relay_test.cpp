#include "app/tracker_relay.h"

#include <gtest/gtest.h>

#include "tests/support/fakes.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

SE3 at(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

class TrackerRelayTest : public ::testing::Test {
 protected:
  // Trackers that say 1 and 2 m, and claim in the frames that are told.
  void begin(std::vector<bool> first, std::vector<bool> second) {
    std::vector<std::unique_ptr<ObjectTracker>> trackers;
    for (auto& claims : {first, second}) {
      const double x = static_cast<double>(trackers.size()) + 1;
      auto tracker = std::make_unique<FakeTracker>(
          "o", [x](int) { return at(x); }, claims);
      fakes.push_back(tracker.get());
      trackers.push_back(std::move(tracker));
    }
    relay.emplace(std::move(trackers));
  }
  ObjectMeasurement track(int k, bool start = false) {
    const std::optional<ObjectPrediction> from =
        start ? std::optional(ObjectPrediction{at(0)}) : std::nullopt;
    return relay->track({k, k * 1000, {}, {}}, from);
  }

  std::vector<FakeTracker*> fakes;
  std::optional<TrackerRelay> relay;
};

TEST_F(TrackerRelayTest, TheFirstThatClaimsIsHeard) {
  begin({true, false, true, false}, {true, true, true, false});
  const double expected[] = {1, 2, 1, 1};
  for (int k = 0; k < 4; ++k) {
    const ObjectMeasurement m = track(k, k == 0);
    EXPECT_EQ(m.T_camera_object.translation.x(), expected[k]) << k;
    EXPECT_EQ(m.claimed, k < 3);
    EXPECT_EQ(m.timestamp_ns, k * 1000);
  }
}

TEST_F(TrackerRelayTest, WhoHasLostItStartsWhereAnotherHasIt) {
  begin({true, false, false}, {true, true, true});
  track(0, true);
  track(1);  // the first loses it
  track(2);
  for (FakeTracker* fake : fakes) {
    ASSERT_EQ(fake->starts.size(), 3u);  // every frame, once
    EXPECT_EQ(fake->starts[0]->translation.x(), 0);
    EXPECT_FALSE(fake->starts[1]);
  }
  ASSERT_TRUE(fakes[0]->starts[2]);
  EXPECT_EQ(fakes[0]->starts[2]->translation.x(), 2);
  EXPECT_FALSE(fakes[1]->starts[2]);
}

TEST_F(TrackerRelayTest, WithoutAStartNobodyIsGivenOne) {
  begin({false}, {false});
  EXPECT_FALSE(track(0).claimed);
  for (FakeTracker* fake : fakes) EXPECT_FALSE(fake->starts.at(0));
}

}  // namespace
}  // namespace diorama
