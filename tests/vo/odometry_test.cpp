// The whole odometry in a drawn room: starts, losses and what is said of them.
#include "vo/odometry.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/matchers.h"
#include "tests/vo/textured_room.h"

namespace diorama {
namespace {

using test::TexturedRoom;

constexpr int kFrames = 75;

// Drawn once for all tests.
const TexturedRoom& room() {
  static const TexturedRoom room;
  return room;
}
const std::vector<Frame>& walk() {
  static const std::vector<Frame> frames = [] {
    std::vector<Frame> drawn;
    for (int k = 0; k < kFrames; ++k) drawn.push_back(room().draw(TexturedRoom::path(k), k));
    return drawn;
  }();
  return frames;
}
Frame blank(int index) {
  Frame frame = walk().front();
  frame.index = index;
  frame.timestamp_ns = index * int64_t{33333000};
  frame.gray = Image<uint8_t>(frame.gray.width, frame.gray.height, 90);
  return frame;
}

// Feeds frames, adds the steps up, and keeps what was said.
struct Driver {
  explicit Driver(const VoOptions& options = {}) : odometry(room().camera, options) {}

  void feed(const Frame& frame, bool with_object = true) {
    step = odometry.track(frame);
    const SE3 truth = TexturedRoom::path(frame.index);
    std::vector<ObjectMeasurement> objects;
    if (with_object && odometry.wantsObjects())
      objects.push_back(room().measureObject(truth, frame.index));
    odometry.update(objects);
    for (const OdometryEvent& event : odometry.events()) events.push_back(event);
    if (!odometry.started()) return;
    if (poses.empty()) start = frame.index;
    SE3 from = poses.empty() ? SE3{} : poses.back();
    if (step)
      for (size_t k = 0; k < times_ns.size(); ++k)
        if (times_ns[k] == step->from_ns) from = poses[k];
    poses.push_back(step ? from * step->T_from_to : from);
    times_ns.push_back(frame.timestamp_ns);
    healthy.push_back(!step || step->health > 0);
  }
  // How far the newest pose is off, the world being the camera of the first one.
  double error(int index) const {
    const SE3 truth = TexturedRoom::path(start).inverse() * TexturedRoom::path(index);
    return (poses.back().translation - truth.translation).norm();
  }
  int count(const std::string& name) const {
    return static_cast<int>(std::count_if(events.begin(), events.end(),
                                          [&](const auto& e) { return e.event == name; }));
  }

  VisualOdometry odometry;
  int start = -1;
  std::vector<SE3> poses;
  std::vector<int64_t> times_ns;
  std::vector<bool> healthy;
  std::vector<OdometryEvent> events;
  std::optional<OdometryMeasurement> step;  // of the newest frame

  // Standard deviation of that step's length, as a share of it.
  double lengthSigma() const {
    const Vector3d rho = step->T_from_to.rotation.conjugate() * step->T_from_to.translation;
    const Vector3d along = rho.normalized();
    return std::sqrt(along.dot(step->covarianceWithScale().topLeftCorner<3, 3>() * along)) /
           rho.norm();
  }
};

TEST(VisualOdometry, IsMetricFromAnObjectAndHoldsOn) {
  Driver driver;
  for (const Frame& frame : walk()) {
    driver.feed(frame);
    if (driver.start >= 0) {
      EXPECT_LT(driver.error(frame.index), 0.008) << frame.index;
    }
  }
  EXPECT_GE(driver.start, 1);
  EXPECT_LE(driver.start, 20);
  EXPECT_EQ(driver.count("lost"), 0);
  ASSERT_EQ(driver.count("started"), 1);
  EXPECT_EQ(driver.events.back().reason, "scale from thing");
  EXPECT_GT(driver.odometry.mapPoints().size(), 60u);
  const auto located = driver.odometry.locate("thing");
  ASSERT_TRUE(located);
  const SE3 truth = room().measureObject(TexturedRoom::path(kFrames - 1), 0).T_camera_object;
  EXPECT_THAT(*located, test::PoseNear(truth, 0.01, 0.02));
  EXPECT_FALSE(driver.odometry.locate("another thing"));
}

TEST(VisualOdometry, GivesTheSameNumbersEachTime) {
  Driver a, b;
  for (int k = 0; k < 40; ++k) a.feed(walk()[static_cast<size_t>(k)]);
  for (int k = 0; k < 40; ++k) b.feed(walk()[static_cast<size_t>(k)]);
  ASSERT_EQ(a.poses.size(), b.poses.size());
  ASSERT_GT(a.poses.size(), 15u);
  for (size_t k = 0; k < a.poses.size(); ++k) {
    EXPECT_EQ(a.poses[k].translation, b.poses[k].translation);
    EXPECT_EQ(a.poses[k].rotation.coeffs(), b.poses[k].rotation.coeffs());
  }
}

TEST(VisualOdometry, ACoveredLensIsALossAndTheCameraIsFoundAgain) {
  Driver driver;
  for (int k = 0; k < 40; ++k) driver.feed(walk()[static_cast<size_t>(k)]);
  ASSERT_GE(driver.start, 0);
  for (int k = 40; k < 52; ++k) driver.feed(blank(k));
  EXPECT_FALSE(driver.healthy.back());
  EXPECT_EQ(driver.count("lost"), 1);
  EXPECT_FALSE(driver.events.back().reason.empty());
  for (int k = 52; k < 62; ++k) driver.feed(walk()[static_cast<size_t>(k)]);
  EXPECT_EQ(driver.count("relocalised"), 1);
  EXPECT_TRUE(driver.healthy.back());
  EXPECT_LT(driver.error(61), 0.01);
}

TEST(VisualOdometry, AnImageOfAnotherSizeIsALossWithAReason) {
  Driver driver;
  for (int k = 0; k < 30; ++k) driver.feed(walk()[static_cast<size_t>(k)]);
  ASSERT_GE(driver.start, 0);
  Frame small = blank(30);
  small.gray = Image<uint8_t>(3, 2, 90);
  driver.feed(small);
  EXPECT_EQ(driver.count("lost"), 1);
  EXPECT_THAT(driver.events.back().reason, testing::HasSubstr("size"));
  driver.feed(walk()[31]);
  EXPECT_TRUE(driver.healthy.back());
}

// A thing in a hand slides along for half a second, and rests again.
std::vector<std::string> playSliding(int from_frame, SE3& step_error) {
  VoOptions options;
  options.start_window_frames = 15;
  VisualOdometry odometry(room().camera, options);
  std::vector<std::string> said;
  for (int k = 0; k < 2 * kFrames; ++k) {
    const SE3 T_world_camera = TexturedRoom::path(k);
    const auto step = odometry.track(room().draw(T_world_camera, k));
    const Vector3d slid(0.02 * std::clamp(k - from_frame, 0, 15), 0, 0);
    const SE3 T_world_object =
        SE3{Eigen::Quaterniond::Identity(), slid} * TexturedRoom::poseOfObject();
    odometry.update(std::vector{room().measureObject(T_world_camera, k, T_world_object)});
    for (const OdometryEvent& event : odometry.events())
      said.push_back(event.event + ": " + event.reason);
    if (step && step->health > 0)
      step_error =
          (TexturedRoom::path(k - 1).inverse() * T_world_camera).inverse() * step->T_from_to;
  }
  return said;
}
bool areContradicted(const std::vector<std::string>& said) {
  return std::any_of(said.begin(), said.end(), [](const std::string& event) {
    return event.find("objects contradict the map") != std::string::npos;
  });
}

TEST(VisualOdometry, AStartThatObjectsContradictIsMadeAnew) {
  SE3 step_error;
  const std::vector<std::string> said = playSliding(12, step_error);
  EXPECT_TRUE(areContradicted(said));
  EXPECT_EQ(said.back().substr(0, 7), "started");
  EXPECT_LT(step_error.translation.norm(), 0.001);
}

TEST(VisualOdometry, AnObjectThatMovesLaterIsNoReasonToStartAnew) {
  SE3 step_error;
  const std::vector<std::string> said = playSliding(30, step_error);
  EXPECT_FALSE(areContradicted(said));
  EXPECT_LT(step_error.translation.norm(), 0.001);
}

TEST(VisualOdometry, WithoutObjectsTheScaleIsUnknownAndItSaysSo) {
  VoOptions options;
  options.start_wait_frames = 10;
  Driver driver(options);
  int k = 0;
  for (; k < 45; ++k) driver.feed(walk()[static_cast<size_t>(k)], false);
  ASSERT_EQ(driver.count("started"), 1);
  EXPECT_THAT(driver.events.back().reason, testing::HasSubstr("scale unknown"));
  EXPECT_TRUE(driver.odometry.wantsObjects());
  EXPECT_EQ(driver.count("lost"), 0);
  // Nor may a graph believe in the lengths, or it turns away objects that are seen later.
  EXPECT_TRUE(driver.step->up_to_scale);
  EXPECT_GE(driver.lengthSigma(), 1);
  EXPECT_LE(driver.step->health, 0.5);
  const auto next = [&] { return room().draw(TexturedRoom::path(k), k); };
  for (; driver.count("reinitialised") == 0 && k < 200; ++k) driver.feed(next());
  ASSERT_EQ(driver.count("reinitialised"), 1);
  // Its first steps carry the map's correction, too.
  for (const int end = k + 5; k < end; ++k) driver.feed(next());
  EXPECT_FALSE(driver.step->up_to_scale);
  EXPECT_LT(driver.lengthSigma(), 0.5);
}

TEST(VisualOdometry, NothingToSeeIsNoStart) {
  Driver driver;
  Frame corner = blank(0);
  for (int y = 60; y < 100; ++y)
    for (int x = 60; x < 100; ++x) corner.gray(x, y) = 200;
  for (int k = 0; k < 60; ++k) {
    corner.index = k;
    corner.timestamp_ns = k * int64_t{33333000};
    driver.feed(k < 30 ? blank(k) : corner);
  }
  EXPECT_FALSE(driver.odometry.started());
  ASSERT_GT(driver.count("reset"), 0);
  EXPECT_THAT(driver.events.back().reason, testing::HasSubstr("no start"));
}

TEST(VisualOdometry, TurningOnTheSpotIsNoStart) {
  VoOptions options;
  options.start_wait_frames = 10;
  options.start_window_frames = 12;
  VisualOdometry odometry(room().camera, options);
  for (int k = 0; k < 25; ++k) {
    const SE3 turned{expSO3(Vector3d(0, 0.012 * k, 0)), Vector3d(0, 0, -0.2)};
    EXPECT_FALSE(odometry.track(room().draw(turned, k)));
    odometry.update({});
    EXPECT_FALSE(odometry.started());
  }
}

// The same frame for two seconds, without any noise, and then on.
TEST(VisualOdometry, ARestIsNoLossNorADrag) {
  Driver driver;
  for (int k = 0; k < 40; ++k) driver.feed(walk()[static_cast<size_t>(k)]);
  ASSERT_GE(driver.start, 0);
  constexpr int kRest = 60;
  for (int k = 1; k <= kRest; ++k) {
    Frame same = walk()[39];
    same.index = 39 + k;
    same.timestamp_ns = same.index * int64_t{33333000};
    driver.feed(same, false);
  }
  for (int k = 40; k < 60; ++k) {
    Frame next = walk()[static_cast<size_t>(k)];
    next.index = k + kRest;
    next.timestamp_ns = next.index * int64_t{33333000};
    driver.feed(next, false);
    EXPECT_LT(driver.error(k), 0.01) << k;
  }
  EXPECT_EQ(driver.count("lost"), 0);
}

// There and back again, farther than the field of view is wide: nothing of the map is seen in
// between.
TEST(VisualOdometry, TurningAwayFromTheMapAndBackIsNoLoss) {
  constexpr int kTurnFrames = 90, kWalked = 45;
  Driver driver;
  for (int k = 0; k < kWalked; ++k) driver.feed(walk()[static_cast<size_t>(k)]);
  ASSERT_GE(driver.start, 0);
  const SE3 rest = TexturedRoom::path(kWalked - 1);
  const SE3 start = TexturedRoom::path(driver.start);
  for (int k = 1; k <= kTurnFrames; ++k) {
    const double angle = 1.2 * std::sin(std::numbers::pi * k / kTurnFrames);
    const SE3 turned = rest * SE3{expSO3(Vector3d(0, angle, 0)), Vector3d::Zero()};
    driver.feed(room().draw(turned, kWalked - 1 + k), false);
    EXPECT_TRUE(driver.healthy.back()) << k;
    EXPECT_THAT(driver.poses.back(), test::PoseNear(start.inverse() * turned, 0.02, 0.02)) << k;
  }
  EXPECT_EQ(driver.count("lost"), 0);
  EXPECT_THAT(driver.poses.back(), test::PoseNear(start.inverse() * rest, 0.008, 0.01));
}

TEST(VisualOdometry, AFrontalWallIsEnough) {
  TexturedRoom wall = room();
  wall.pillar = false;
  VisualOdometry odometry(wall.camera);
  const auto pose = [](int k) {
    return SE3{Eigen::Quaterniond::Identity(), Vector3d(0.008 * k - 0.1, 0, 0.6)};
  };
  SE3 T_start_now;
  int start = -1;
  for (int k = 0; k < 30; ++k) {
    const auto step = odometry.track(wall.draw(pose(k), k));
    odometry.update(std::vector{wall.measureObject(pose(k), k)});
    if (step) T_start_now = T_start_now * step->T_from_to;
    if (odometry.started() && start < 0) start = k;
  }
  ASSERT_GE(start, 0);
  EXPECT_LT((T_start_now.translation - Vector3d(0.008 * (29 - start), 0, 0)).norm(), 0.01);
}

}  // namespace
}  // namespace diorama
