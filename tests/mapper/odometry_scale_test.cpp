#include "mapper/odometry_scale.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

MapperOptions withScale(double sigma) {
  MapperOptions options;
  options.odometry_scale_sigma = sigma;
  return options;
}

// The odometry of a graph, `factor` times as long from a frame on.
SyntheticGraph stretched(const SyntheticOptions& options, uint64_t seed, double factor,
                         size_t from = 0) {
  SyntheticGraph graph = makeGraph(options, seed);
  for (size_t k = from; k < graph.odometry.size(); ++k)
    graph.odometry[k].T_from_to.translation *= factor;
  return graph;
}

struct Outcome {
  double error_m = 0, nees = 0;
};

// Of an object, seen from the newest pose: means over the second half of some graphs.
Outcome outcomeOf(const MapperOptions& options, double factor) {
  Outcome outcome;
  double frames = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const SyntheticGraph graph =
        stretched({.poses = 300, .object_sigma_m = 3e-3, .object_sigma_rad = 1e-2}, seed, factor);
    Mapper mapper(options);
    for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
      feed(mapper, graph, k);
      if (k < 150) continue;
      const ObjectPrediction p = mapper.predict("object0").value();
      const Vector6d e =
          log(p.T_camera_object.inverse() * (graph.camera(k).inverse() * graph.objects[0]));
      outcome.error_m += e.head<3>().norm();
      outcome.nees += e.dot(p.covariance.inverse() * e);
      ++frames;
    }
  }
  return {outcome.error_m / frames, outcome.nees / frames};
}

TEST(OdometryScale, DoesNotPullObjectsNearer) {
  const Outcome trusted = outcomeOf(withScale(0), 0.99), unsure = outcomeOf(withScale(0.01), 0.99);
  const Outcome right = outcomeOf(withScale(0.01), 1);
  std::printf(
      "steps 1%% short: %.2f mm, nees %.1f; unsure of the scale %.2f, %.1f; right %.2f, %.1f\n",
      1e3 * trusted.error_m, trusted.nees, 1e3 * unsure.error_m, unsure.nees, 1e3 * right.error_m,
      right.nees);
  EXPECT_LT(unsure.error_m, 0.85 * trusted.error_m);
  EXPECT_LT(unsure.error_m, 1.05 * right.error_m);
  EXPECT_LT(unsure.nees, 12);
  EXPECT_LT(unsure.nees, 0.7 * trusted.nees);
  EXPECT_LT(right.nees, 10);
}

// Past the known, steps all err alike: what is predicted is off by as much as it may be.
TEST(OdometryScale, IsNotTrustedElsewhere) {
  constexpr size_t kAway = 100;
  const auto nees = [&](const MapperOptions& options) {
    Mapper mapper(options);
    mapper.start(0);
    SE3 T_world_camera;
    const SE3 T_world_object{Eigen::Quaterniond::Identity(), {0, 0, 1}};
    for (size_t k = 0; k < 200; ++k) {
      const bool away = k >= kAway;
      const auto now_ns = static_cast<int64_t>(k) * 33'333'333;
      // Sideways, with one turn away from the object.
      const SE3 step{expSO3({0, k == kAway ? 1.2 : 0, 0}), {away ? 0.01 : 0.004, 0, 0}};
      SE3 measured = step;
      if (away) measured.translation *= 0.95;
      if (k > 0) {
        T_world_camera = T_world_camera * step;
        EXPECT_TRUE(mapper.addOdometry(
            {"vo", now_ns - 33'333'333, now_ns, measured, diagonalCovariance(2e-4, 1e-4), 1}));
      }
      if (!away) {
        EXPECT_TRUE(
            mapper.addObject({"edge", "o", now_ns, T_world_camera.inverse() * T_world_object,
                              diagonalCovariance(1e-3, 1e-3), 1, true, ""}));
      }
      mapper.update();
    }
    const ObjectPrediction p = mapper.predict("o").value();
    const Vector6d e =
        log(p.T_camera_object.inverse() * (T_world_camera.inverse() * T_world_object));
    return e.dot(p.covariance.inverse() * e);
  };
  EXPECT_GT(nees(withScale(0)), 50);
  EXPECT_LT(nees(withScale(0.003)), 12);
}

class OdometryScaleVariable : public ::testing::Test {
 protected:
  OdometryScaleVariable() : smoother({}, {}, {}) { smoother.start(0); }

  std::optional<size_t> step(const std::string& source, bool elsewhere, bool anew = false,
                             bool up_to_scale = false) {
    OdometryMeasurement measurement;
    measurement.source = source;
    measurement.up_to_scale = up_to_scale;
    const std::optional<size_t> variable = scale.next(smoother, measurement, elsewhere, anew);
    OdometryFactor factor{{Eigen::Quaterniond::Identity(), {0.01, 0, 0}},
                          Whitening(1e4 * Matrix6d::Identity())};
    factor.scale = variable;
    smoother.addPose(++k_, factor);
    smoother.update();
    return variable;
  }

  ChainSmoother smoother;
  OdometryScale scale{0.01, 0.05};
  int64_t k_ = 0;
};

TEST_F(OdometryScaleVariable, IsAnotherOneElsewhereAndOfAnotherOdometry) {
  const std::optional<size_t> first = step("vo", false);
  ASSERT_TRUE(first);
  EXPECT_EQ(step("vo", false), first);
  const std::optional<size_t> away = step("vo", true);
  EXPECT_NE(away, first);
  EXPECT_EQ(step("vo", true), away);
  EXPECT_EQ(step("vo", false), away);  // what it measures by now was begun there
  EXPECT_NE(step("vo", true), away);
  EXPECT_NE(step("other", true), away);
  // Lost, and begun anew.
  const std::optional<size_t> other = step("other", true);
  EXPECT_EQ(step("other", true), other);
  EXPECT_NE(step("other", true, true), other);
  EXPECT_NEAR(std::sqrt(smoother.objectCovariance(*away)(0, 0)), 0.05, 1e-6);
  // Those that are left behind are eliminated.
  EXPECT_FALSE(smoother.isActive(*first));
  EXPECT_LE(smoother.joint().slots.size(), 2u);
}

TEST_F(OdometryScaleVariable, IsNoneWhereTheScaleIsKnown) {
  scale = OdometryScale(0, 0.05);
  EXPECT_FALSE(step("vo", false));
  EXPECT_FALSE(step("vo", true));
  EXPECT_EQ(smoother.objectCount(), 0u);
  EXPECT_EQ(scale.estimate(smoother).s, 0);
}

TEST_F(OdometryScaleVariable, IsItsOwnWhileNothingIsKnownOfIt) {
  const std::optional<size_t> unknown = step("vo", false, false, true);
  EXPECT_EQ(step("vo", true, false, true), unknown);
  EXPECT_NEAR(scale.estimate(smoother).sigma, 1, 1e-6);
  const std::optional<size_t> known = step("vo", false);
  EXPECT_NE(known, unknown);
  EXPECT_NEAR(scale.estimate(smoother).sigma, 0.01, 1e-6);
  EXPECT_FALSE(smoother.isActive(*unknown));
  // Also where a scale is trusted once it is known.
  scale = OdometryScale(0, 0.05);
  EXPECT_TRUE(step("vo", false, false, true));
  EXPECT_FALSE(step("vo", false));
}

class OdometryUpToScale : public ::testing::TestWithParam<double> {};

// An object comes into view late: all that was measured before is as long as it was, and the map
// stays where it is.
TEST_P(OdometryUpToScale, IsLearntOfAllOfTheWay) {
  constexpr size_t kSeen = 120, kKnown = 170;
  SyntheticGraph graph = makeGraph({.poses = 400, .object_sigma_m = 1e-3}, 5);
  for (size_t k = 0; k < kKnown; ++k) {
    graph.odometry[k].T_from_to.translation *= GetParam();
    graph.odometry[k].up_to_scale = true;
  }
  Mapper mapper(withScale(0.003));
  double worst_m = 0;
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k < kSeen) graph.observations[k].clear();
    feed(mapper, graph, k);
    if (k <= kKnown) continue;
    const Vector3d p = mapper.estimate().T_world_camera.translation;
    worst_m = std::max(worst_m, (p - graph.camera(k).translation).norm());
  }
  EXPECT_LT(worst_m, 0.03);
  EXPECT_FALSE(mapper.isMoving("object0"));
  mapper.finish();
  const Trajectory way = mapper.smoothedTrajectory();
  for (size_t k = 0; k < way.poses.size(); ++k)
    EXPECT_LT((way.poses[k].pose.translation - graph.camera(k).translation).norm(), 0.03) << k;
}

INSTANTIATE_TEST_SUITE_P(Factors, OdometryUpToScale, testing::Values(0.35, 1.4, 2.5));

// Only the odometry that is named has a map: the steps of another one are lengths.
TEST(OdometryScaleInTheMap, IsThatOfTheOdometryWithAMap) {
  const SyntheticGraph graph = stretched({.poses = 200}, 3, 0.99);
  const auto error_m = [&](const char* with_map) {
    MapperOptions options = withScale(0.01);
    options.odometry_with_map = with_map;
    Mapper mapper(options);
    feedAll(mapper, graph);
    return (mapper.predict("object0")->T_camera_object.translation -
            (graph.camera(199).inverse() * graph.objects[0]).translation)
        .norm();
  };
  EXPECT_EQ(error_m(""), error_m("simulated"));
  EXPECT_NE(error_m(""), error_m("vo"));
}

}  // namespace
}  // namespace diorama
