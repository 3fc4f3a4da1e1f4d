// Hundreds of starts on random paths: each within 15 frames of enough parallax; and one behind a
// board that moves with the camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
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

// No corner lies on it.
struct SmallThing : RayQuery {
  void occluded(int, const Vector3d&, std::span<const Vector3d>,
                std::span<uint8_t>) const override {}
  std::optional<RayHit> closestHit(int, const Vector3d&, const Vector3d&) const override {
    return std::nullopt;
  }
};

// On an arc around the object, which stays in the middle of the view.
SE3 onArc(int frame) {
  const double angle = 1.8 * std::sin(frame / 30.0);
  const Matrix3d R = expSO3(Vector3d(0.1 * std::sin(frame / 20.0), -angle, 0)).toRotationMatrix();
  return {Eigen::Quaterniond(R),
          TexturedRoom::poseOfObject().translation - R * Vector3d(0, 0, 0.9)};
}

// Held before the lens: blocks of chance grey in the right part of the picture.
void coverWithBoard(Frame& frame, double share) {
  constexpr int kBlock = 12;
  const Random random(3, RandomStream::kTest);
  Image<uint8_t>& grey = frame.gray;
  for (int y = 0; y < grey.height; ++y)
    for (int x = static_cast<int>((1 - share) * grey.width); x < grey.width; ++x)
      grey(x, y) =
          static_cast<uint8_t>(40 + 160 * random.uniform(static_cast<uint32_t>(x / kBlock),
                                                         static_cast<uint64_t>(y / kBlock))[0]);
}

// In two frames the board agrees with a camera that moves around what is in the middle.
TEST(VisualOdometryStart, IsThatOfTheWorldBehindABoardThatMovesWithTheCamera) {
  TexturedRoom room;
  room.pillar = false;
  room.camera = Camera{CameraParameters{
      CameraModel::kRadTan, 480, 360, 400, 400, 242, 176, {-0.15, 0.04, 0.001, -0.001}}};
  VisualOdometry odometry(room.camera, {}, "vo", {std::make_shared<SmallThing>(), {"thing"}});
  int start = -1;
  SE3 T_start_now;
  for (int k = 0; k < kFrames; ++k) {
    Frame frame = room.draw(onArc(k), k);
    coverWithBoard(frame, 0.25);
    const auto step = odometry.track(frame);
    if (step) T_start_now = T_start_now * step->T_from_to;
    odometry.update(std::vector{room.measureObject(onArc(k), k)});
    if (odometry.started() && start < 0) start = k;
  }
  ASSERT_GE(start, 0);
  EXPECT_LT(start, 45);
  const SE3 T_true = onArc(start).inverse() * onArc(kFrames - 1);
  EXPECT_LT((T_start_now.translation - T_true.translation).norm(), 0.01);
}

}  // namespace
}  // namespace diorama
