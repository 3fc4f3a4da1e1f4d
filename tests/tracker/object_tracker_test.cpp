#include "tracker/object_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "core/errors.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

struct PoseError {
  double m, rad;
};

PoseError errorOf(const SE3& estimate, const SE3& truth) {
  return {(estimate.translation - truth.translation).norm(),
          angleBetween(estimate.rotation, truth.rotation)};
}

std::unique_ptr<EdgeTracker> makeTracker(const test::BoxScene& scene, TrackerOptions options = {}) {
  return std::make_unique<EdgeTracker>(scene.object(), scene.camera,
                                       std::make_shared<test::BoxRays>(scene.box), 0, options);
}

ObjectPrediction startAt(const SE3& T_camera_object) {
  return {T_camera_object, Matrix6d::Identity()};
}

SE3 poseOf(int frame) { return test::boxPose(0.03 * frame); }

TEST(EdgeTracker, FollowsAPrintedBox) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  for (int i = 0; i < 20; ++i) {
    std::optional<ObjectPrediction> start;
    if (i == 0) start = startAt(poseOf(0));
    const ObjectMeasurement m = tracker->track(scene.draw(poseOf(i), i), start);
    EXPECT_TRUE(m.claimed) << i << ": " << m.reason;
    EXPECT_EQ(m.source, "edge");
    EXPECT_EQ(m.object, "box");
    const PoseError e = errorOf(m.T_camera_object, poseOf(i));
    EXPECT_LT(e.m, 0.003) << i;
    EXPECT_LT(e.rad, 0.015) << i;
    EXPECT_EQ(m.covariance.llt().info(), Eigen::Success);
  }
}

TEST(EdgeTracker, ParticlesFollowItAsWell) {
  const test::BoxScene scene;
  TrackerOptions options;
  options.particles = 20;
  const auto tracker = makeTracker(scene, options);
  for (int i = 0; i < 12; ++i) {
    const auto start = i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt;
    const ObjectMeasurement m = tracker->track(scene.draw(poseOf(i), i), start);
    EXPECT_TRUE(m.claimed) << i << ": " << m.reason;
    EXPECT_LT(errorOf(m.T_camera_object, poseOf(i)).m, 0.003) << i;
  }
}

// Annealed particles reach farther than the rounds of one hypothesis do.
TEST(EdgeTracker, AnnealingHelpsAStartThatIsFarOff) {
  const test::BoxScene scene;
  const Frame frame = scene.draw(poseOf(0), 0);
  TrackerOptions without;
  without.filter.start_particles = 0;
  int found = 0, found_without = 0;
  for (int i = 0; i < 8; ++i) {
    Vector6d off;
    off << 0.012 * std::cos(i), 0.012 * std::sin(i), 0.01 * std::cos(2 * i), 0.06 * std::sin(3 * i),
        0.06 * std::cos(3 * i), 0.05;
    const auto isFound = [&](const TrackerOptions& options) {
      const ObjectMeasurement m =
          makeTracker(scene, options)->track(frame, startAt(poseOf(0) * exp(off)));
      return m.claimed && errorOf(m.T_camera_object, poseOf(0)).m < 0.004;
    };
    found += isFound({});
    found_without += isFound(without);
  }
  EXPECT_GT(found, found_without);
}

// A wrong valley may look healthy: the one beside it where the edges agree sharply is the right
// one.
TEST(EdgeTracker, LeavesAWrongValleyAtTheStart) {
  test::BoxScene scene;
  scene.print = 40;
  const Frame frame = scene.draw(poseOf(0), 0);
  TrackerOptions with, without;
  with.filter.start_particles = without.filter.start_particles = 0;
  without.neighbour_rounds = 0;
  int found = 0, found_without = 0;
  for (int i = 0; i < 12; ++i) {
    Vector6d off;
    off << 0.008 * std::cos(i), 0.008 * std::sin(i), 0.008 * std::cos(2 * i),
        0.05 * std::sin(3 * i), 0.05 * std::cos(3 * i), 0.03 * std::sin(i);
    const auto isFound = [&](const TrackerOptions& options) {
      const ObjectMeasurement m =
          makeTracker(scene, options)->track(frame, startAt(poseOf(0) * exp(off)));
      return m.claimed && errorOf(m.T_camera_object, poseOf(0)).m < 0.002;
    };
    found += isFound(with);
    found_without += isFound(without);
  }
  EXPECT_GT(found, found_without);
}

TEST(EdgeTracker, ConvergesFromAPerturbedStart) {
  for (const double print : {0.0, 40.0}) {
    test::BoxScene scene;
    scene.print = print;
    Vector6d off;
    off << 0.006, -0.006, 0.01, 0.03, -0.03, 0.03;
    const auto tracker = makeTracker(scene);
    const ObjectMeasurement m = tracker->track(
        scene.draw(poseOf(0), 0),
        startAt(poseOf(0) * exp(print > 0 ? Vector6d(0.4 * off) : off)));  // prints mislead
    EXPECT_TRUE(m.claimed) << m.reason;
    EXPECT_LT(errorOf(m.T_camera_object, poseOf(0)).m, 0.002) << print;
    EXPECT_LT(errorOf(m.T_camera_object, poseOf(0)).rad, 0.015) << print;
  }
}

TEST(EdgeTracker, WhatIsKnownBesideTheImagesCountsInWhatFollows) {
  const test::BoxScene scene;
  const auto variancesFrom = [&](bool independent) {
    std::optional<ObjectPrediction> start{{poseOf(0), 1e-8 * Matrix6d::Identity()}};
    start->independent = independent;
    const auto tracker = makeTracker(scene);
    std::vector<double> variances;
    for (int i = 0; i < 4; ++i, start.reset())
      variances.push_back(tracker->track(scene.draw(poseOf(i), i), start).covariance.trace());
    return variances;
  };
  const std::vector<double> with = variancesFrom(true), without = variancesFrom(false);
  for (size_t i = 0; i < 4; ++i) EXPECT_LT(with[i], 0.9 * without[i]) << i;
}

TEST(EdgeTracker, SaysWithinThreeFramesThatTheObjectIsGone) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  for (int i = 0; i < 4; ++i)
    tracker->track(scene.draw(poseOf(i), i),
                   i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt);
  ObjectMeasurement m;
  for (int i = 4; i < 7; ++i) m = tracker->track(scene.draw(poseOf(i), i, true), std::nullopt);
  EXPECT_FALSE(m.claimed);
  EXPECT_FALSE(m.reason.empty());
  EXPECT_TRUE(m.T_camera_object.isFinite());
  // It comes back where it was left.
  for (int i = 7; i < 10; ++i) m = tracker->track(scene.draw(poseOf(4), i), std::nullopt);
  EXPECT_TRUE(m.claimed) << m.reason;
  EXPECT_LT(errorOf(m.T_camera_object, poseOf(4)).m, 0.003);
}

// An unknown thing slides over half of the object, with edges and print of its own, and moves on.
TEST(EdgeTracker, HoldsWhatIsHalfCovered) {
  const test::BoxScene scene;
  const auto claims = [&](const TrackerOptions& options) {
    const auto tracker = makeTracker(scene, options);
    int right = 0;
    for (int i = 0; i < 30; ++i) {
      Frame frame = scene.draw(poseOf(i), i);
      for (int y = 0; y < frame.gray.height; ++y)
        for (int x = std::max(0, 60 + 6 * i - 90); x < std::min(60 + 6 * i, frame.gray.width); ++x)
          frame.gray(x, y) = (x - 6 * i + 1000) / 12 % 2 ? 25 : 60;
      const auto start = i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt;
      const ObjectMeasurement m = tracker->track(frame, start);
      const bool is_right = errorOf(m.T_camera_object, poseOf(i)).m < 0.005;
      EXPECT_TRUE(!m.claimed || errorOf(m.T_camera_object, poseOf(i)).m < 0.05) << i;
      right += m.claimed && is_right;
    }
    return right;
  };
  TrackerOptions blind;
  blind.surface_points = 0;
  const int right = claims({});
  EXPECT_GT(right, claims(blind));
  EXPECT_GE(right, 25);
}

// An object that comes out from behind something is found again sooner when it is known where.
TEST(EdgeTracker, WhatCoversAnObjectThatIsExpectedIsNoObjection) {
  const test::BoxScene scene;
  const auto claims = [&](const Matrix6d& covariance) {
    int right = 0;
    for (int covered_px = 60; covered_px <= 110; covered_px += 5) {
      const auto tracker = makeTracker(scene);
      for (int i = 0; i < 4; ++i)
        tracker->track(scene.draw(poseOf(i), i),
                       i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt);
      Frame frame = scene.draw(poseOf(4), 4);
      for (int y = 0; y < frame.gray.height; ++y)
        for (int x = 0; x < frame.gray.width / 2 - 80 + covered_px; ++x)
          frame.gray(x, y) = (x + y / 3) / 12 % 2 ? 25 : 60;
      const ObjectMeasurement m = tracker->track(frame, ObjectPrediction{poseOf(4), covariance});
      right += m.claimed && errorOf(m.T_camera_object, poseOf(4)).m < 0.01;
    }
    return right;
  };
  const int unexpected = claims(Matrix6d::Identity());
  const int expected = claims(1e-6 * Matrix6d::Identity());
  std::printf("claimed half covered: %d, where it is expected %d of 11\n", unexpected, expected);
  EXPECT_GT(expected, unexpected);
}

TEST(EdgeTracker, AnewFromAGivenStart) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  for (int i = 0; i < 3; ++i)
    tracker->track(scene.draw(poseOf(i), i),
                   i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt);
  // The object jumps; should its own rescue find it there, it must have found it well.
  const SE3 elsewhere =
      SE3{Eigen::Quaterniond::Identity(), Vector3d(-0.12, 0.02, 0.1)} * poseOf(30);
  const Frame frame = scene.draw(elsewhere, 3);
  const ObjectMeasurement alone = tracker->track(frame, std::nullopt);
  if (alone.claimed) {
    EXPECT_LT(errorOf(alone.T_camera_object, elsewhere).m, 0.003);
  }
  Vector6d off;
  off << 0.004, -0.003, 0.004, 0.02, 0.01, -0.02;
  const ObjectMeasurement m =
      tracker->track(scene.draw(elsewhere, 4), startAt(elsewhere * exp(off)));
  EXPECT_TRUE(m.claimed) << m.reason;
  EXPECT_LT(errorOf(m.T_camera_object, elsewhere).m, 0.003);
  EXPECT_LT(errorOf(m.T_camera_object, elsewhere).rad, 0.015);
}

TEST(EdgeTracker, AWrongStartIsNotClaimed) {
  const test::BoxScene scene;
  for (int i = 0; i < 6; ++i) {
    Vector6d off;
    off << 0.08 * std::cos(i), 0.08 * std::sin(i), 0.1, 0.5 * std::sin(2 * i), 0.6, 0.7;
    const auto tracker = makeTracker(scene);
    const ObjectMeasurement m =
        tracker->track(scene.draw(poseOf(0), 0), startAt(poseOf(0) * exp(off)));
    EXPECT_FALSE(m.claimed) << i << ' ' << m.health;
  }
}

TEST(EdgeTracker, NothingIsClaimedInAnEmptyPicture) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  Frame frame;
  frame.gray = Image<uint8_t>(scene.camera.width(), scene.camera.height(), 120);
  EXPECT_FALSE(tracker->track(frame, std::nullopt).claimed);  // no start yet
  for (int i = 0; i < 5; ++i) {
    const ObjectMeasurement m = tracker->track(frame, startAt(poseOf(0)));
    EXPECT_FALSE(m.claimed);
    EXPECT_FALSE(m.reason.empty());
    EXPECT_TRUE(m.T_camera_object.isFinite());
    EXPECT_TRUE(m.covariance.allFinite());
  }
}

TEST(EdgeTracker, PosesWithNothingInTheImageAreNotClaimed) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  const Frame frame = scene.draw(poseOf(0), 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vector3d& t : {Vector3d(5, 0, 1), Vector3d(0, 0, -1), Vector3d(0, 0, 0),
                            Vector3d(0, 0, 1e6), Vector3d(nan, 0, 1), Vector3d(0, 0, 0.1)}) {
    for (const bool again : {false, true}) {
      const auto start =
          again ? std::nullopt : std::optional(startAt(SE3{Eigen::Quaterniond::Identity(), t}));
      const ObjectMeasurement m = tracker->track(frame, start);
      EXPECT_FALSE(m.claimed) << t.transpose();
      EXPECT_TRUE(m.T_camera_object.isFinite());
      EXPECT_TRUE(m.covariance.allFinite());
    }
  }
}

TEST(EdgeTracker, ImagesThatDoNotFitTheCamera) {
  const test::BoxScene scene;
  const auto tracker = makeTracker(scene);
  for (const auto& [w, h] : {std::pair(0, 0), std::pair(1, 1), std::pair(640, 480)}) {
    Frame frame;
    frame.gray = Image<uint8_t>(w, h, 90);
    const ObjectMeasurement m = tracker->track(frame, startAt(poseOf(0)));
    EXPECT_FALSE(m.claimed);
    EXPECT_NE(m.reason.find("size"), std::string::npos);
  }
  // A camera of one pixel is legal, if useless.
  test::BoxScene tiny;
  tiny.camera = Camera(CameraParameters{CameraModel::kPinhole, 1, 1, 1, 1, 0, 0, {}});
  const auto small = makeTracker(tiny);
  EXPECT_FALSE(small->track(tiny.draw(poseOf(0), 0), startAt(poseOf(0))).claimed);
}

TEST(EdgeTracker, RefusesAMeshWithoutEdges) {
  ObjectModel nothing;
  nothing.name = "nothing";
  try {
    EdgeTracker tracker(nothing, Camera(), std::make_shared<test::BoxRays>(), 0);
    FAIL();
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("no edges that can be seen"), std::string::npos);
  }
}

TEST(EdgeTracker, SameInputSameResult) {
  const test::BoxScene scene;
  const auto a = makeTracker(scene), b = makeTracker(scene);
  for (int i = 0; i < 8; ++i) {
    const Frame frame = scene.draw(poseOf(i), i, i == 4 || i == 5);  // the rescue runs too
    const auto start = i == 0 ? std::optional(startAt(poseOf(0))) : std::nullopt;
    const ObjectMeasurement ma = a->track(frame, start), mb = b->track(frame, start);
    EXPECT_EQ(ma.T_camera_object.matrix(), mb.T_camera_object.matrix());
    EXPECT_EQ(ma.covariance, mb.covariance);
    EXPECT_EQ(ma.health, mb.health);
  }
}

}  // namespace
}  // namespace diorama
