#include "mapper/odometry_anchor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kMemory_s = 2, kStep_s = 1.0 / 30;

// Steps of an odometry whose error dies away with the memory, and objects whose trackers err alike
// for some time.
SyntheticGraph slowErrors(int poses, uint64_t seed, double memory_s = kMemory_s) {
  SyntheticOptions options{.poses = poses, .objects = 2, .noise = false};
  SyntheticGraph graph = makeGraph(options, seed);
  Numbers numbers(seed + 1000);
  const auto drawn = [&](const Matrix6d& P) {
    return Vector6d(P.diagonal().cwiseSqrt().cwiseProduct(numbers.normal6()));
  };
  Vector6d drift = Vector6d::Zero();
  std::vector<Vector6d> biases(graph.objects.size(), Vector6d::Zero());
  for (size_t j = 0; j < biases.size(); ++j) biases[j] = drawn(graph.observations[0][j].covariance);
  const double keep = 1 - kStep_s / memory_s, bias_keep = std::exp(-kStep_s / 1.2);
  for (size_t k = 0; k < graph.observations.size(); ++k) {
    if (k > 0) {
      OdometryMeasurement& step = graph.odometry[k - 1];
      const Vector6d before = drift;
      drift = keep * drift + drawn(step.covariance);
      step.T_from_to = exp(Vector6d(-before)) * step.T_from_to * exp(drift);
    }
    for (size_t j = 0; j < biases.size(); ++j) {
      ObjectMeasurement& m = graph.observations[k][j];
      biases[j] =
          bias_keep * biases[j] + std::sqrt(1 - bias_keep * bias_keep) * drawn(m.covariance);
      m.T_camera_object = m.T_camera_object * exp(biases[j]);
    }
  }
  return graph;
}

struct Outcome {
  double camera_m = 0, nees = 0;
};

Outcome outcomeOf(double memory_s) {
  MapperOptions options;
  options.object_sigma_scale = 6;
  options.odometry_memory_s = memory_s;
  Outcome outcome;
  double frames = 0, graphs = 0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const SyntheticGraph graph = slowErrors(450, seed);
    Mapper mapper(options);
    MapEstimate estimate;
    for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
      estimate = feed(mapper, graph, k);
      outcome.camera_m +=
          (estimate.T_world_camera.translation - graph.camera(k).translation).norm();
      ++frames;
    }
    for (size_t j = 0; j < graph.objects.size(); ++j, ++graphs) {
      const Vector6d e = log(estimate.objects[j].T_world_object.inverse() * graph.objects[j]);
      outcome.nees += e.dot(estimate.objects[j].covariance.inverse() * e);
    }
  }
  return {outcome.camera_m / frames, outcome.nees / graphs};
}

TEST(OdometryAnchor, HoldsTheCameraWhereTrackersErrForLong) {
  const Outcome steps_only = outcomeOf(0), held = outcomeOf(kMemory_s);
  printf("camera error %.2f mm, with memory %.2f; nees %.1f, %.1f\n", 1e3 * steps_only.camera_m,
         1e3 * held.camera_m, steps_only.nees, held.nees);
  EXPECT_LT(held.camera_m, 0.9 * steps_only.camera_m);
  EXPECT_LT(held.nees, 12);
}

// An odometry that is wrong for good, which its steps do not say: objects go on being believed.
TEST(OdometryAnchor, GivesWayToObjectsThatContradictIt) {
  for (const double memory_s : {0.0, kMemory_s}) {
    SyntheticGraph graph = makeGraph({.poses = 300}, 5);
    for (OdometryMeasurement& step : graph.odometry) step.T_from_to.translation *= 1.06;
    MapperOptions options;
    options.object_sigma_scale = 6;
    options.odometry_memory_s = memory_s;
    Mapper mapper(options);
    int rejected = 0;
    for (size_t k = 0; k < graph.observations.size(); ++k) {
      if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
      if (k > 0) {
        ASSERT_TRUE(mapper.addOdometry(graph.odometry[k - 1]));
      }
      rejected += !mapper.addObject(graph.observations[k][0]);
      mapper.update();
    }
    EXPECT_LE(rejected, 15) << memory_s;  // 5%
  }
}

class OdometryAnchorSteps : public ::testing::Test {
 protected:
  OdometryAnchorSteps() : smoother({}, {}, {}), anchor(kMemory_s, 1, 22.46) { smoother.start(0); }

  void step(bool in_view, double error_m = 0, double sigma_m = 2e-4) {
    const int64_t from_ns = k_ * int64_t{33'333'333}, to_ns = ++k_ * int64_t{33'333'333};
    const SE3 Z{expSO3({0, 0.01, 0}), {0.01 + error_m, 0, 0}};
    const OdometryMeasurement m{source, from_ns, to_ns, Z, diagonalCovariance(sigma_m, 3e-4), 1};
    smoother.addPose(to_ns, *makeOdometryFactor(m, 1).factor);
    anchor.addStep(smoother, m, in_view);
    smoother.update();
  }
  double sigma_m() const { return std::sqrt(smoother.cameraCovariance()(1, 1)); }

  ChainSmoother smoother;
  OdometryAnchor anchor;
  std::string source = "vo";
  int64_t k_ = 0;
};

TEST_F(OdometryAnchorSteps, WithoutDriftNothingMoves) {
  SE3 expected;
  for (int k = 0; k < 200; ++k) {
    step(true);
    expected = expected * SE3{expSO3({0, 0.01, 0}), {0.01, 0, 0}};
  }
  EXPECT_TRUE(anchor.holds());
  EXPECT_THAT(smoother.T_world_camera(200).matrix(), MatrixNear(expected.matrix(), 1e-9));
}

// An odometry that learns its scale: what it measured before is not as sure as what it measures
// now.
TEST_F(OdometryAnchorSteps, PreciseStepsDoNotVouchForVagueOnes) {
  for (int k = 0; k < 20; ++k) step(true, 0, 0.1);
  EXPECT_TRUE(anchor.holds());
  step(true);
  EXPECT_FALSE(anchor.holds());
  step(true);
  EXPECT_TRUE(anchor.holds());
}

// What is not known of the camera's pose stops to grow; looking away it grows again.
TEST_F(OdometryAnchorSteps, BoundsTheDriftWhileItLooksThere) {
  for (int k = 0; k < 300; ++k) step(true);
  const double held = sigma_m();
  for (int k = 0; k < 300; ++k) step(true);
  EXPECT_LT(sigma_m(), 1.3 * held);
  step(false);
  EXPECT_FALSE(anchor.holds());
  const size_t objects = smoother.objectCount();
  for (int k = 0; k < 300; ++k) step(false);
  EXPECT_GT(sigma_m(), 1.5 * held);
  EXPECT_EQ(smoother.objectCount(), objects);
  step(true);
  EXPECT_TRUE(anchor.holds());
  EXPECT_EQ(smoother.objectCount(), objects + 1);
}

TEST_F(OdometryAnchorSteps, AnotherOdometryHasItsOwnPlace) {
  for (int k = 0; k < 10; ++k) step(true);
  EXPECT_EQ(smoother.objectCount(), 1u);
  source = "other";
  for (int k = 0; k < 10; ++k) step(true);
  EXPECT_EQ(smoother.objectCount(), 2u);
  EXPECT_TRUE(anchor.holds());
}

TEST_F(OdometryAnchorSteps, WithoutMemoryThereIsNone) {
  anchor = OdometryAnchor(0, 1, 22.46);
  for (int k = 0; k < 5; ++k) step(true);
  EXPECT_FALSE(anchor.holds());
  EXPECT_EQ(smoother.objectCount(), 0u);
}

TEST(OdometryAnchorInTheMap, OnlyPosesAreReportedAndGapsEndIt) {
  MapperOptions options;
  options.odometry_memory_s = kMemory_s;
  Mapper mapper(options);
  const SyntheticGraph graph = slowErrors(120, 3);
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    const AddResult added = k == 0    ? AddResult{true}
                            : k == 60 ? mapper.addGap(graph.truth.poses[k].timestamp_ns)
                                      : mapper.addOdometry(graph.odometry[k - 1]);
    ASSERT_TRUE(added) << added.reason;
    for (const ObjectMeasurement& m : graph.observations[k]) (void)mapper.addObject(m);
    EXPECT_EQ(mapper.update().objects.size(), 2u);
  }
  const MapEstimate final = mapper.finish();
  ASSERT_EQ(final.objects.size(), 2u);
  for (size_t j = 0; j < 2; ++j)
    EXPECT_LT(log(final.objects[j].T_world_object.inverse() * graph.objects[j]).head<3>().norm(),
              5e-3);
}

}  // namespace
}  // namespace diorama
