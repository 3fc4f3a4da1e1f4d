// Ten thousand frames: what the odometry keeps is bounded by its keyframes.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/vo/textured_room.h"
#include "vo/odometry.h"

namespace diorama {
namespace {

using test::TexturedRoom;

TEST(VisualOdometryEndurance, MemoryIsBoundedByTheKeyframes) {
  constexpr int kFrames = 10000, kDrawn = 300, kKeyframes = 9;
  const TexturedRoom room;
  std::vector<Frame> frames;
  for (int k = 0; k < kDrawn; ++k) frames.push_back(room.draw(TexturedRoom::path(k), k));
  VoOptions options;
  options.max_keyframes = kKeyframes;
  VisualOdometry odometry(room.camera, options);
  size_t early = 0, late = 0;
  for (int k = 0; k < kFrames; ++k) {
    // To the end of the path and back again.
    const int turn = k % (2 * kDrawn - 2), at = turn < kDrawn ? turn : 2 * kDrawn - 2 - turn;
    Frame& frame = frames[static_cast<size_t>(at)];
    frame.index = k;
    frame.timestamp_ns = k * int64_t{33333000};
    odometry.track(frame);
    ObjectMeasurement object = room.measureObject(TexturedRoom::path(at), k);
    odometry.update(std::span(&object, odometry.wantsObjects() ? 1 : 0));
    ASSERT_LE(odometry.keyframeCount(), kKeyframes) << k;
    size_t& most = k < kFrames / 5 ? early : late;
    most = std::max(most, odometry.mapPoints().size());
  }
  EXPECT_TRUE(odometry.started());
  EXPECT_LE(late, early + early / 2);
  std::printf(
      "10000 frames: %d keyframes, at most %zu points in the first 2000 frames, %zu later\n",
      odometry.keyframeCount(), early, late);
}

}  // namespace
}  // namespace diorama
