#include "sim/motion_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "core/errors.h"
#include "core/files.h"
#include "core/random.h"

namespace diorama {
namespace {

// Keyframes at random times (0.05 to 1.5 s apart) that turn by up to max_turn_rad each.
std::vector<Keyframe> randomKeyframes(uint64_t seed, uint32_t count, double max_turn_rad) {
  const Random random(seed, RandomStream::kTest);
  std::vector<Keyframe> keyframes;
  SE3 pose;
  double time = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const auto u = random.uniform(i, 0), n = random.normal(i, 1);
    time += 0.05 + 1.45 * u[0];
    const Vector3d axis = Vector3d(n[0], n[1], n[2]).normalized();
    pose.rotation = (pose.rotation * expSO3(axis * u[1] * max_turn_rad)).normalized();
    pose.translation += Vector3d(n[1], n[2], n[3]) * 0.3;
    keyframes.push_back({time, pose});
  }
  return keyframes;
}

// First and second derivative on one side of a time, in the world (velocity) and in the tangent
// of the pose at that time (rotation), by one-sided finite differences of third order.
struct Derivatives {
  Vector3d v, a, w, dw;
};
Derivatives oneSided(const MotionPath& path, double time, double h) {
  std::array<Vector3d, 4> p, r;
  const SE3 base = path.pose(time);
  for (int k = 0; k < 4; ++k) {
    const SE3 pose = path.pose(time + k * h);
    p[static_cast<size_t>(k)] = pose.translation;
    r[static_cast<size_t>(k)] = logSO3(base.rotation.conjugate() * pose.rotation);
  }
  const auto first = [&](const auto& x) -> Vector3d {
    return (-11 * x[0] + 18 * x[1] - 9 * x[2] + 2 * x[3]) / (6 * h);
  };
  const auto second = [&](const auto& x) -> Vector3d {
    return (2 * x[0] - 5 * x[1] + 4 * x[2] - x[3]) / (h * h);
  };
  return {first(p), second(p), first(r), second(r)};
}

TEST(SplinePath, PassesThroughItsKeyframes) {
  for (uint64_t seed = 1; seed <= 50; ++seed) {
    const double max_turn = seed % 2 ? 0.8 : 2.4;
    const std::vector<Keyframe> keyframes =
        randomKeyframes(seed, static_cast<uint32_t>(2 + seed % 20), max_turn);
    const auto path = makeSplinePath(keyframes);
    for (const Keyframe& k : keyframes) {
      const SE3 pose = path->pose(k.time_s);
      EXPECT_LT((pose.translation - k.pose.translation).norm(), 1e-12) << seed;
      EXPECT_LT(angleBetween(pose.rotation, k.pose.rotation), 1e-9) << seed;
    }
  }
}

TEST(SplinePath, IsTwiceContinuouslyDifferentiableAtTheKeyframes) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const std::vector<Keyframe> keyframes = randomKeyframes(seed, 8, 1.0);
    const auto path = makeSplinePath(keyframes);
    for (size_t i = 1; i + 1 < keyframes.size(); ++i) {
      const double t = keyframes[i].time_s, h = 2e-4;
      const Derivatives right = oneSided(*path, t, h), left = oneSided(*path, t, -h);
      EXPECT_LT((right.v - left.v).norm(), 1e-5 * (1 + right.v.norm())) << seed << " " << i;
      EXPECT_LT((right.w - left.w).norm(), 1e-5 * (1 + right.w.norm())) << seed << " " << i;
      EXPECT_LT((right.a - left.a).norm(), 2e-3 * (1 + right.a.norm())) << seed << " " << i;
      EXPECT_LT((right.dw - left.dw).norm(), 2e-3 * (1 + right.dw.norm())) << seed << " " << i;
    }
  }
}

TEST(SplinePath, TwoKeyframesMakeAConstantScrewAndTheEndsRest) {
  const SE3 a = lookAt({1, 0, 0.5}, {0, 0, 0}), b = lookAt({0, 1, 0.5}, {0, 0, 0});
  const auto path = makeSplinePath({{1, a}, {3, b}});
  const SE3 middle = path->pose(2);
  EXPECT_LT((middle.translation - (a.translation + b.translation) / 2).norm(), 1e-12);
  EXPECT_NEAR(angleBetween(a.rotation, path->pose(1.5).rotation),
              angleBetween(a.rotation, b.rotation) / 4, 1e-12);
  EXPECT_EQ(path->pose(-5).translation, path->pose(1).translation);
  EXPECT_LT((path->pose(99).translation - b.translation).norm(), 1e-12);
  const auto resting = makeSplinePath({{1, a}});
  EXPECT_EQ(resting->pose(0).translation, a.translation);
}

TEST(SplinePath, RestsBetweenEqualKeyframes) {
  const SE3 a = lookAt({1, 0, 0.5}, {0, 0, 0}), b = lookAt({0, 1, 0.5}, {0, 0, 0});
  const SE3 c = lookAt({0, 1, 0.9}, {0.3, 0, 0});
  const auto path = makeSplinePath({{0, a}, {2, a}, {3, b}, {4.5, c}, {6, c}, {7, b}});
  for (const auto& [from_s, until_s, pose] : {std::tuple(0.0, 2.0, a), std::tuple(4.5, 6.0, c)})
    for (double t = from_s; t <= until_s; t += 0.05) {
      EXPECT_EQ(path->pose(t).translation, pose.translation) << t;
      EXPECT_LT(angleBetween(path->pose(t).rotation, pose.rotation), 1e-12) << t;
    }
  EXPECT_LT((path->pose(3).translation - b.translation).norm(), 1e-12);
  EXPECT_LT(angleBetween(path->pose(3).rotation, b.rotation), 1e-9);
  constexpr double h = 2e-4;
  for (const double t : {2.0, 3.0, 4.5, 6.0}) {
    const Derivatives right = oneSided(*path, t, h), left = oneSided(*path, t, -h);
    EXPECT_LT((right.v - left.v).norm(), 1e-5) << t;
    EXPECT_LT((right.w - left.w).norm(), 1e-5) << t;
    EXPECT_EQ(t == 3.0, right.v.norm() > 0.1) << t;
  }
}

TEST(LookAt, PutsTheTargetInTheMiddleAndTheWorldUpright) {
  const Vector3d position(0.5, -0.7, 0.4), target(0.1, 0.05, 0.12);
  const SE3 T = lookAt(position, target);
  const Vector3d p_camera = T.inverse() * target;
  EXPECT_NEAR(p_camera.x(), 0, 1e-12);
  EXPECT_NEAR(p_camera.y(), 0, 1e-12);
  EXPECT_NEAR(p_camera.z(), (target - position).norm(), 1e-12);
  EXPECT_NEAR((T.rotation * Vector3d::UnitX()).z(), 0, 1e-12);  // no roll
  EXPECT_LT((T.rotation * Vector3d::UnitY()).z(), 0);           // y is down
  EXPECT_NEAR(angleBetween(T.rotation, lookAt(position, target, 0.2).rotation), 0.2, 1e-12);
}

TEST(LookAt, StraightDownAndUpAreProperRotations) {
  for (double z : {-1.0, 1.0}) {
    const SE3 T = lookAt({0.3, 0.2, 0.5}, {0.3, 0.2, 0.5 + z});
    ASSERT_TRUE(T.isFinite());
    EXPECT_NEAR(T.rotation.norm(), 1, 1e-12);
    EXPECT_LT(((T.rotation * Vector3d::UnitZ()) - Vector3d(0, 0, z)).norm(), 1e-12);
    EXPECT_LT(((T.rotation * Vector3d::UnitY()) - Vector3d(0, -1, 0)).norm(), 1e-12);
    EXPECT_NEAR(T.rotationMatrix().determinant(), 1, 1e-12);
  }
}

TEST(OrbitPath, CirclesItsCentre) {
  Orbit orbit;
  orbit.center = {0.1, 0.2, 0.3};
  orbit.rate_rad_s = std::numbers::pi;
  const auto path = makeAimedPath(onOrbit(orbit), aimAt([&](double) { return orbit.center; }));
  EXPECT_LT((path->pose(0).translation - Vector3d(0.9, 0.2, 0.7)).norm(), 1e-12);
  EXPECT_LT((path->pose(0.5).translation - Vector3d(0.1, 1.0, 0.7)).norm(), 1e-12);
  const Vector3d p_camera = path->pose(0.3).inverse() * Vector3d(0.1, 0.2, 0.3);
  EXPECT_LT(p_camera.head<2>().norm(), 1e-12);
}

TEST(OrbitPath, SwingsAboutItsMeans) {
  Orbit orbit;
  orbit.radius_m = 1;
  orbit.height_m = 0.5;
  orbit.rate_rad_s = 0;
  orbit.azimuth_swing = {{std::numbers::pi / 4, 4}, {std::numbers::pi / 4, 4}};
  orbit.radius_swing = {{0.25, 8}};
  orbit.height_swing = {{0.1, 4}};
  const PointOverTime position = onOrbit(orbit);
  EXPECT_LT((position(0) - Vector3d(1, 0, 0.5)).norm(), 1e-12);
  EXPECT_LT((position(1) - Vector3d(0, 1 + 0.25 * std::sqrt(0.5), 0.6)).norm(), 1e-12);
  EXPECT_LT((position(2) - Vector3d(1.25, 0, 0.5)).norm(), 1e-12);
}

TEST(DollyPath, StartsAndStopsSmoothly) {
  const PointOverTime position = onDolly({0, 0, 0}, {2, 0, 0}, 1, 3);
  EXPECT_EQ(position(0.5), Vector3d(0, 0, 0));
  EXPECT_EQ(position(4), Vector3d(2, 0, 0));
  EXPECT_LT((position(2) - Vector3d(1, 0, 0)).norm(), 1e-12);
  for (double end : {1.0, 3.0})
    EXPECT_LT(std::abs(position(end + 1e-3).x() - position(end - 1e-3).x()), 1e-7);
  for (double t = 1; t < 3; t += 0.01) EXPECT_LE(position(t).x(), position(t + 0.01).x() + 1e-12);
}

TEST(AimedPath, FollowsATargetThatMoves) {
  const PointOverTime target = onDolly({1, 0, 0}, {1, 1, 0}, 0, 1);
  const auto path = makeAimedPath(
      [](double) -> Vector3d {
        return {0, 0, 0.5};
      },
      aimAt(target, 0.1));
  for (double t : {0.0, 0.4, 1.0}) {
    const Vector3d p_camera = path->pose(t).inverse() * target(t);
    EXPECT_LT(p_camera.head<2>().norm(), 1e-12);
    EXPECT_GT(p_camera.z(), 0);
  }
}

TEST(AimedPath, MayPassThroughItsTarget) {
  const auto path = makeAimedPath(
      [](double t) -> Vector3d {
        return {t, 0, 0};
      },
      aimAt([](double) -> Vector3d {
        return {1, 0, 0};
      }));
  EXPECT_TRUE(path->pose(1).isFinite());
}

class RecordedPath : public ::testing::Test {
 protected:
  std::filesystem::path file_ =
      std::filesystem::path(::testing::TempDir()) /
      (std::string("recorded_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(RecordedPath, TumPosesAreReproducedInPlaceScaleAndTime) {
  Trajectory recording;
  for (const Keyframe& k : randomKeyframes(7, 200, 0.3))
    recording.poses.push_back({static_cast<int64_t>(k.time_s * 1e6) * 1000, k.pose});
  writeFileAtomically(file_, toTum(recording));
  const Placement placement{lookAt({1, 2, 3}, {0, 0, 0}), 0.5, 2};
  const auto path = makeRecordedPath(readRecording(file_, RecordingFormat::kTum), placement);
  const int64_t start = recording.poses[0].timestamp_ns;
  for (const StampedPose& stamped : recording.poses) {
    const SE3 pose = path->pose(static_cast<double>(stamped.timestamp_ns - start) * 1e-9 * 0.5);
    const SE3 expected =
        placement.T_world_recorded * SE3{stamped.pose.rotation, 2 * stamped.pose.translation};
    EXPECT_LT((pose.translation - expected.translation).norm(), 1e-9);
    EXPECT_LT(angleBetween(pose.rotation, expected.rotation), 1e-9);
  }
}

TEST_F(RecordedPath, EurocHasNanosecondsAndTheScalarFirst) {
  writeFileAtomically(file_,
                      "#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z, v\n"
                      "1403636580838555648,1,2,3,0.8,0.6,0,0,9\r\n"
                      "1403636581838555648,1,2,4,1,0,0,0,9\n");
  const Trajectory recording = readRecording(file_, RecordingFormat::kEuroc);
  ASSERT_EQ(recording.poses.size(), 2u);
  EXPECT_EQ(recording.poses[0].timestamp_ns, 1403636580838555648);
  EXPECT_NEAR(recording.poses[0].pose.rotation.w(), 0.8, 1e-12);
  EXPECT_NEAR(recording.poses[0].pose.rotation.x(), 0.6, 1e-12);
  EXPECT_EQ(recording.poses[1].pose.translation, Vector3d(1, 2, 4));
}

TEST_F(RecordedPath, BadFilesAreOneClearLine) {
  for (const char* text :
       {"", "#only a header\n", "1,2,3\n", "x,1,2,3,1,0,0,0\n", "5,1,2,3,0,0,0,0\n",
        "5,nan,2,3,1,0,0,0\n", "5,1,2,3,1,0,0,0\n5,1,2,3,1,0,0,0\n"}) {
    writeFileAtomically(file_, text);
    EXPECT_THROW(readRecording(file_, RecordingFormat::kEuroc), InputError) << text;
  }
  EXPECT_THROW(readRecording("/no/such/file", RecordingFormat::kTum), MissingInputError);
}

}  // namespace
}  // namespace diorama
