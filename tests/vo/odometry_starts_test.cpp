// Hundreds of starts on random paths: each within 15 frames of enough parallax.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "tests/vo/textured_room.h"
#include "vo/odometry.h"

namespace diorama {
namespace {

using test::TexturedRoom;

constexpr int kTrials = 100, kFrames = 90, kGraceFrames = 15;
// The default of start_baseline_rad times the distance of the wall, which is all that is far.
constexpr double kEnoughM = 0.08 * 1.4;

// From anywhere in the middle of the room, in any direction across the view, turning a little.
struct RandomPath {
  Vector3d from, velocity, turn;  // m, m/s, rad/s

  RandomPath(uint64_t seed, int trial) {
    const Random random(seed, RandomStream::kTest);
    const auto draw = [&](uint64_t k) { return random.uniform(static_cast<uint32_t>(trial), k); };
    const auto a = draw(0), b = draw(1), c = draw(2);
    const auto centred = [](double u) { return 2 * u - 1; };
    from = Vector3d(0.15 * centred(a[0]), 0.15 * centred(a[1]), -0.2 + 0.15 * centred(b[0]));
    const double heading = 2 * std::numbers::pi * b[1], speed = 0.1 + 0.25 * c[0];
    velocity = speed * Vector3d(std::cos(heading), std::sin(heading), 0.3 * centred(c[1]));
    const auto d = draw(3), e = draw(4);
    turn = 0.15 * Vector3d(centred(d[0]), centred(d[1]), centred(e[0]));
  }
  SE3 at(int frame) const {
    const double t = frame / 30.0;
    return {expSO3(turn * t), from + velocity * t};
  }
};

// Frames from enough parallax to the start; nothing without one.
std::optional<int> framesToStart(const TexturedRoom& room, const RandomPath& path) {
  VisualOdometry odometry(room.camera);
  int enough = -1;
  for (int k = 0; k < kFrames; ++k) {
    const SE3 pose = path.at(k);
    if (enough < 0 && (pose.translation - path.from).norm() >= kEnoughM) enough = k;
    odometry.track(room.draw(pose, k));
    odometry.update(std::vector{room.measureObject(pose, k)});
    if (odometry.started()) return enough < 0 ? 0 : k - enough;
    if (enough >= 0 && k > enough + kGraceFrames) break;
  }
  return std::nullopt;
}

class VisualOdometryStarts : public testing::TestWithParam<uint64_t> {};

TEST_P(VisualOdometryStarts, AHundredOfAHundredOnRandomPaths) {
  const TexturedRoom room;
  int slowest = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::optional<int> frames = framesToStart(room, RandomPath(GetParam(), trial));
    ASSERT_TRUE(frames) << "trial " << trial;
    EXPECT_LE(*frames, kGraceFrames) << "trial " << trial;
    slowest = std::max(slowest, *frames);
  }
  std::printf("%d starts, the slowest %d frames after enough parallax\n", kTrials, slowest);
}

INSTANTIATE_TEST_SUITE_P(Seeds, VisualOdometryStarts, testing::Values(23, 1, 2, 3));

}  // namespace
}  // namespace diorama
