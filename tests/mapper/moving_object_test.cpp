#include "mapper/moving_object.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

// Pushed by 20 cm and turned by 0.5 rad from frame 120 to 210, gently at both ends.
SE3 pushed(const SE3& T_world_object, int frame) {
  const double t = std::clamp((frame - 120) / 90.0, 0.0, 1.0);
  const double way = t * t * (3 - 2 * t);
  return SE3{Eigen::Quaterniond::Identity(), 0.2 * way * Vector3d(0.8, 0.6, 0)} * T_world_object *
         SE3{expSO3(Vector3d(0, 0, 0.5 * way)), Vector3d::Zero()};
}

ObjectMeasurement* measurementOf(SyntheticGraph& graph, size_t k, const std::string& object) {
  for (ObjectMeasurement& m : graph.observations[k])
    if (m.object == object) return &m;
  return nullptr;
}

// Puts what is measured of an object elsewhere; the noise stays.
template <class Place>
void replace(SyntheticGraph& graph, size_t object, const Place& place) {
  for (size_t k = 0; k < graph.observations.size(); ++k) {
    ObjectMeasurement* m = measurementOf(graph, k, "object" + std::to_string(object));
    if (!m) continue;
    const SE3 T_camera_world = graph.camera(k).inverse();
    const SE3 noise = (T_camera_world * graph.objects[object]).inverse() * m->T_camera_object;
    m->T_camera_object = T_camera_world * place(graph.objects[object], static_cast<int>(k)) * noise;
  }
}

struct Decisions {
  std::map<std::string, int> count;  // "moving object0" and so on
  double worst_m = 0;                // of object 0, while it is reported
};

template <class Truth>
Decisions run(Mapper& mapper, const SyntheticGraph& graph, const Truth& truth) {
  Decisions decisions;
  for (size_t k = 0; k < graph.observations.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    if (k > 0) {
      EXPECT_TRUE(mapper.addOdometry(graph.odometry[k - 1]).added);
    }
    for (const ObjectMeasurement& m : graph.observations[k]) {
      const AddResult added = mapper.addObject(m);
      if (!added.decision.empty()) ++decisions.count[added.decision + " " + m.object];
    }
    const MapEstimate map = mapper.update();
    const SE3 expected = graph.camera(k).inverse() * truth(graph.objects[0], static_cast<int>(k));
    const SE3 believed = map.T_world_camera.inverse() * map.objects.at(0).T_world_object;
    decisions.worst_m =
        std::max(decisions.worst_m, (believed.translation - expected.translation).norm());
  }
  return decisions;
}

const auto kStill = [](const SE3& T, int) { return T; };

TEST(MovingObject, FollowsAndForetellsConstantVelocity) {
  Numbers numbers(3);
  const Matrix6d covariance = diagonalCovariance(1e-3, 5e-3);
  Vector6d velocity;
  velocity << 0.1, -0.05, 0.02, 0.1, 0.2, -0.3;
  const auto truth = [&](int k) { return exp(velocity * (k / 30.0)); };
  const auto time = [](int k) { return k * int64_t{33'333'333}; };
  MovingObject object(MotionOptions{}, 0, truth(0), covariance);
  double sum = 0;
  for (int k = 1; k <= 60; ++k)
    sum += object.absorb(time(k), disturbed(truth(k), covariance, numbers, true), covariance, 1e9);
  EXPECT_LT(sum / 60, 7);
  EXPECT_NEAR(object.speed_m_s(), velocity.head<3>().norm(), 0.02);
  const MovingObject::Place soon = object.at(time(63));
  EXPECT_THAT(soon.T_world_object, PoseNear(truth(63), 5e-3, 0.03));
  EXPECT_GT(object.at(time(90)).covariance(0, 0), 10 * soon.covariance(0, 0));
  const SE3 before = object.at(time(60)).T_world_object;
  EXPECT_GT(object.absorb(time(61), truth(75), covariance, 22.46), 22.46);
  EXPECT_THAT(object.at(time(60)).T_world_object, PoseNear(before, 0.02, 0.05));
}

TEST(MovingObjects, OneThatIsPushedIsFollowedAndRestsAgain) {
  for (const uint64_t seed : {1u, 2u, 3u}) {
    SyntheticGraph graph = makeGraph({.poses = 330, .objects = 2}, seed);
    replace(graph, 0, pushed);
    Mapper mapper;
    const Decisions decisions = run(mapper, graph, pushed);
    EXPECT_EQ(decisions.count,
              (std::map<std::string, int>{{"moving object0", 1}, {"resting object0", 1}}));
    EXPECT_LT(decisions.worst_m, 0.035) << "before it is known that it moves";
    EXPECT_FALSE(mapper.isMoving("object0"));
    const MapEstimate map = mapper.finish();
    EXPECT_THAT(map.objects[0].T_world_object, PoseNear(pushed(graph.objects[0], 329), 3e-3, 5e-3));
    EXPECT_THAT(map.objects[1].T_world_object, PoseNear(graph.objects[1], 2e-3, 4e-3));
    EXPECT_THAT(map.T_world_camera, PoseNear(graph.camera(329), 3e-3, 5e-3));
  }
}

// The camera is then where the odometry alone puts it.
TEST(MovingObjects, TheOnlyObjectMovesNotTheCamera) {
  SyntheticGraph graph = makeGraph({.poses = 200, .objects = 1}, 4);
  replace(graph, 0, pushed);
  Mapper mapper;
  const Decisions decisions = run(mapper, graph, pushed);
  EXPECT_EQ(decisions.count, (std::map<std::string, int>{{"moving object0", 1}}));
  EXPECT_TRUE(mapper.isMoving("object0"));
  EXPECT_LT((mapper.estimate().T_world_camera.translation - graph.camera(199).translation).norm(),
            0.01);
}

TEST(MovingObjects, StillOnesAreStatic) {
  for (const uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    const SyntheticGraph graph = makeGraph({.poses = 600, .objects = 3, .visible = 0.7}, seed);
    Mapper mapper;
    EXPECT_TRUE(run(mapper, graph, kStill).count.empty());
  }
}

TEST(MovingObjects, ATrackerThatJumpsOrFallsIllIsNoMotion) {
  const auto jumps = [](const SE3& T, int k) {
    return k < 150 ? T : SE3{Eigen::Quaterniond::Identity(), {0.08, 0.02, 0}} * T;
  };
  SyntheticGraph jumping = makeGraph({.poses = 250, .objects = 2}, 5);
  replace(jumping, 0, jumps);
  Mapper first;
  EXPECT_TRUE(run(first, jumping, kStill).count.empty());

  SyntheticGraph ill = makeGraph({.poses = 250, .objects = 2}, 6);
  replace(ill, 0, pushed);
  for (size_t k = 118; k < 215; ++k) measurementOf(ill, k, "object0")->health = 0.5;
  Mapper second;
  EXPECT_TRUE(run(second, ill, kStill).count.empty());
}

// Odometry that is wrong by a tenth, and does not know it, moves all objects alike.
TEST(MovingObjects, WrongOdometryMovesNothing) {
  SyntheticGraph graph = makeGraph({.poses = 300, .objects = 3}, 7);
  for (OdometryMeasurement& m : graph.odometry) m.T_from_to.translation *= 1.1;
  Mapper mapper;
  EXPECT_TRUE(run(mapper, graph, kStill).count.empty());
}

// Half a turn about z does not show; the tracker says now this pose, now the other.
TEST(MovingObjects, SymmetricOnesTurnAsTheyLike) {
  SyntheticGraph graph = makeGraph({.poses = 330, .objects = 2}, 8);
  const SE3 half{Eigen::Quaterniond(0, 0, 0, 1), Vector3d::Zero()};
  replace(graph, 0,
          [&](const SE3& T, int k) { return k % 3 == 0 ? pushed(T, k) * half : pushed(T, k); });
  Mapper mapper;
  Symmetries symmetries;
  symmetries.discrete.push_back(half);
  mapper.setSymmetries("object0", symmetries);
  const Decisions decisions = run(mapper, graph, pushed);
  EXPECT_EQ(decisions.count,
            (std::map<std::string, int>{{"moving object0", 1}, {"resting object0", 1}}));
}

}  // namespace
}  // namespace diorama
