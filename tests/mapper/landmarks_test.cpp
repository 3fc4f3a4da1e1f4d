// The gate and the landmarks: clean measurements pass as often as they should, wrong ones do no
// harm.
#include "mapper/landmarks.h"

#include <gtest/gtest.h>

#include "mapper/mapper.h"
#include "tests/mapper/wrong_measurements.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kDegree = 3.14159265358979323846 / 180;

SyntheticOptions coarse() {
  return {.poses = 600,
          .objects = 5,
          .visible = 0.6,
          .odometry_sigma_m = 4e-3,
          .odometry_sigma_rad = 2e-3,
          .object_sigma_m = 8e-3,
          .object_sigma_rad = 2e-2};
}

struct GateCount {
  int measured = 0, added = 0;
  double innovation = 0;
  double share() const { return static_cast<double>(added) / measured; }
  double mean() const { return innovation / measured; }
};

// Of measurements of objects that have a landmark.
void countGate(const SyntheticGraph& graph, const MapperOptions& options, GateCount& count) {
  Mapper mapper(options);
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    if (k > 0) {
      ASSERT_TRUE(mapper.addOdometry(graph.odometry[k - 1]));
    }
    for (const ObjectMeasurement& m : graph.observations[k]) {
      const AddResult result = mapper.addObject(m);
      if (!result.innovation) continue;
      ++count.measured;
      count.added += result.added;
      count.innovation += *result.innovation;
    }
    mapper.update();
  }
}

TEST(Gate, PassesCleanMeasurementsAsOftenAsItShould) {
  GateCount count;
  for (uint64_t seed = 1; seed <= 14; ++seed) countGate(makeGraph(coarse(), seed), {}, count);
  std::printf("clean: %d measurements, %.3f%% pass, mean normalised innovation %.3f\n",
              count.measured, 100 * count.share(), count.mean());
  EXPECT_GE(count.measured, 20000);
  EXPECT_NEAR(count.share(), 0.999, 0.001);
  EXPECT_NEAR(count.mean(), 6, 0.1);
}

// Read literally it locks out good measurements, since the object's covariance shrinks.
TEST(Gate, PapersRuleIsThereForTheComparison) {
  MapperOptions options;
  options.gate.kind = "paper";
  GateCount count;
  countGate(makeGraph(coarse(), 1), options, count);
  std::printf("paper's rule: %.1f%% of clean measurements pass\n", 100 * count.share());
  EXPECT_LT(count.share(), 0.5);
  options.gate.kind = "none";
  countGate(makeGraph(coarse(), 1), options, count = {});
  EXPECT_EQ(count.added, count.measured);
}

// How many of the objects end within 3 cm and 5 degrees.
int goodObjects(Wrong kind, double share, uint64_t seed, bool symmetric) {
  SyntheticGraph graph = makeGraph(coarse(), seed);
  makeWrong(graph, kind, share, seed);
  Mapper mapper;
  if (symmetric)
    for (const char* name : {"object0", "object1", "object2", "object3", "object4"})
      mapper.setSymmetries(name, {{flip()}, std::nullopt});
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    if (k > 0) {
      EXPECT_TRUE(mapper.addOdometry(graph.odometry[k - 1]));
    }
    for (const ObjectMeasurement& m : graph.observations[k]) static_cast<void>(mapper.addObject(m));
    mapper.update();
  }
  int good = 0;
  for (const ObjectEstimate& object : mapper.finish().objects) {
    const SE3& truth = graph.objects[static_cast<size_t>(object.name.back() - '0')];
    const auto near = [&](const SE3& T) {
      return (object.T_world_object.translation - T.translation).norm() < 0.03 &&
             angleBetween(object.T_world_object.rotation, T.rotation) < 5 * kDegree;
    };
    good += near(truth) || (symmetric && near(truth * flip()));
  }
  return good;
}

struct Bar {
  const char* name;
  Wrong kind;
  bool symmetric;
  int at50, at70, at90;  // of 25 objects
};

TEST(WrongMeasurements, DoNoHarm) {
  for (const Bar& bar : {Bar{"random", Wrong::kRandom, false, 25, 25, 25},
                         Bar{"clutter", Wrong::kClutter, false, 25, 23, 11},
                         Bar{"flipped", Wrong::kFlipped, false, 11, 0, 0},
                         Bar{"flipped, symmetry declared", Wrong::kFlipped, true, 25, 25, 25}}) {
    int good[3] = {0, 0, 0};
    const double shares[3] = {0.5, 0.7, 0.9};
    for (int i = 0; i < 3; ++i)
      for (uint64_t seed = 1; seed <= 5; ++seed)
        good[i] += goodObjects(bar.kind, shares[i], seed, bar.symmetric);
    std::printf("wrong 50/70/90%%, %s: %d/%d/%d of 25 good\n", bar.name, good[0], good[1], good[2]);
    EXPECT_GE(good[0], bar.at50) << bar.name;
    EXPECT_GE(good[1], bar.at70) << bar.name;
    EXPECT_GE(good[2], bar.at90) << bar.name;
  }
}

TEST(Symmetry, TurnsAMeasurementToTheNearestPose) {
  Numbers numbers(3);
  const Vector3d axis = direction(numbers);
  for (int i = 0; i < 20; ++i) {
    const SE3 expected = numbers.pose(1);
    const SE3 turn{expSO3(numbers.uniform(-3, 3) * axis), Vector3d::Zero()};
    ObjectFactor factor{0, expected * turn, Matrix6d::Identity()};
    EXPECT_THAT(nearestBySymmetry(factor, expected, {{}, axis}).Z, PoseNear(expected, 1e-9, 1e-9));
    factor.Z = expected * flip();
    EXPECT_THAT(nearestBySymmetry(factor, expected, {{flip()}, {}}).Z,
                PoseNear(expected, 1e-9, 1e-9));
    // Whitened residuals keep their size.
    factor.W = Vector6d(Vector6d::Random().cwiseAbs() + Vector6d::Ones()).asDiagonal();
    const ObjectFactor other = nearestBySymmetry(factor, expected, {{flip()}, {}});
    const Vector6d xi = 0.1 * numbers.normal6();
    const SE3 seen = factor.Z * exp(xi);
    EXPECT_NEAR((factor.W * log(factor.Z.inverse() * seen)).norm(),
                (other.W * log(other.Z.inverse() * (seen * flip()))).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace diorama
