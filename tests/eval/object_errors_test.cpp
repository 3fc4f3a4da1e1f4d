#include "eval/object_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "eval/pose_errors.h"
#include "tests/support/matchers.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kDegree = std::numbers::pi / 180;

ObjectModel boxModel() {
  ObjectModel model;
  for (int i = 0; i < 8; ++i)
    model.mesh.positions.emplace_back(i & 1 ? 0.05f : -0.05f, i & 2 ? 0.1f : -0.1f,
                                      i & 4 ? 0.02f : -0.02f);
  return model;
}

SE3 shifted(double metres, double degrees = 0) {
  return {expSO3({0, 0, degrees * kDegree}), {metres, 0, 1}};
}

ObjectFrame frame(double metres, double degrees = 0) {
  ObjectFrame f;
  f.truth = shifted(0);
  f.reported = shifted(metres, degrees);
  return f;
}

ObjectMetrics evaluateObject(const std::vector<ObjectFrame>& frames, const ObjectModel& model) {
  ObjectEvaluation evaluation(model);
  for (const ObjectFrame& frame : frames) evaluation.add(frame);
  return evaluation.metrics();
}

TEST(ObjectErrors, HandComputedSequence) {
  std::vector<ObjectFrame> frames;
  frames.push_back(frame(0.004, 0.5));  // both successes
  frames.push_back(frame(0.02, 3));     // 5 cm, 5 degrees
  frames.push_back(frame(0.02, 6));     // rotation too large
  frames.push_back(frame(0.3));         // near, no success
  frames.push_back(frame(0.6));         // far
  frames.push_back(frame(0));
  frames.back().reported.reset();  // nothing reported
  frames.push_back({});            // no truth: no error, but a frame all the same
  for (size_t i : {0u, 2u, 5u}) frames[i].visible_fraction = 0.4;
  frames[1].visible_fraction = 0.39;
  const ObjectMetrics m = evaluateObject(frames, boxModel());
  const double mean = (0.004 + 0.02 + 0.02 + 0.3) / 4;
  EXPECT_NEAR(*m.mean_error_m, mean, 1e-9);
  EXPECT_NEAR(*m.median_error_m, 0.02, 1e-9);
  EXPECT_NEAR(
      *m.std_error_m,
      std::sqrt(
          (std::pow(0.004 - mean, 2) + 2 * std::pow(0.02 - mean, 2) + std::pow(0.3 - mean, 2)) / 4),
      1e-9);
  EXPECT_NEAR(*m.mean_error_rad, (0.5 + 3 + 6) / 4 * kDegree, 1e-9);
  EXPECT_NEAR(*m.ratio_below_0_5_m, 4.0 / 6, 1e-12);
  EXPECT_NEAR(*m.reported_ratio, 5.0 / 7, 1e-12);
  EXPECT_NEAR(*m.success_5cm_5deg, 2.0 / 6, 1e-12);
  EXPECT_NEAR(*m.success_1cm_1deg, 1.0 / 6, 1e-12);
  EXPECT_NEAR(*m.success_visible_5cm_5deg, 1.0 / 3, 1e-12);
  EXPECT_NEAR(*m.success_visible_1cm_1deg, 1.0 / 3, 1e-12);
  EXPECT_EQ(*m.claimed_ratio, 0);
  EXPECT_FALSE(m.false_claim_ratio);  // of nothing
  EXPECT_FALSE(m.tracker_nees);
  EXPECT_FALSE(m.map_error_m);
}

TEST(ObjectErrors, ClaimsAreJudgedByTheRawPose) {
  std::vector<ObjectFrame> frames(4, frame(0));
  for (ObjectFrame& f : frames) f.claimed = true;
  frames[0].raw = shifted(0.01);
  frames[1].raw = shifted(0.06);
  frames[2].raw = shifted(0, 5.5);
  frames[3].claimed = false;
  frames[3].raw = shifted(0.3);
  frames[0].raw_covariance = 1e-4 * Matrix6d::Identity();  // 1 cm: e^T P^-1 e = 1
  frames[1].raw_covariance = 4e-4 * Matrix6d::Identity();  // 2 cm: 9
  const ObjectMetrics m = evaluateObject(frames, boxModel());
  EXPECT_NEAR(*m.claimed_ratio, 0.75, 1e-12);
  EXPECT_NEAR(*m.false_claim_ratio, 2.0 / 3, 1e-12);
  EXPECT_NEAR(*m.tracker_nees, 5, 1e-9);
  EXPECT_NEAR(*m.success_1cm_1deg, 1, 1e-12);
}

TEST(ObjectErrors, AddCurveIsIntegratedExactly) {
  // Pure translations: ADD is their length.
  std::vector<ObjectFrame> frames{frame(0), frame(0.02), frame(0.05), frame(0.2), frame(0)};
  frames.back().reported.reset();
  EXPECT_NEAR(*evaluateObject(frames, boxModel()).add_auc_10cm, (1 + 0.8 + 0.5 + 0 + 0) / 5, 1e-7);
}

TEST(ObjectErrors, NothingKnownGivesNothing) {
  const ObjectMetrics none = evaluateObject({}, boxModel());
  ObjectMetrics::visit(none,
                       [](const char* name, const auto& field) { EXPECT_FALSE(field) << name; });
  // Never reported: ratios are known, errors are not. No vertices: no ADD.
  std::vector<ObjectFrame> frames(3, frame(0));
  for (ObjectFrame& f : frames) f.reported.reset();
  const ObjectMetrics lost = evaluateObject(frames, ObjectModel{});
  EXPECT_FALSE(lost.mean_error_m);
  EXPECT_FALSE(lost.add_auc_10cm);
  EXPECT_EQ(*lost.success_5cm_5deg, 0);
  EXPECT_EQ(*lost.ratio_below_0_5_m, 0);
  EXPECT_FALSE(lost.success_visible_5cm_5deg);
}

TEST(ObjectErrors, PosesThatAreNotFiniteCountAsFailures) {
  std::vector<ObjectFrame> frames{frame(0), frame(0)};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  frames[1].reported->translation.x() = nan;
  frames[1].claimed = true;
  frames[1].raw = frames[1].reported;
  frames[0].claimed = true;
  frames[0].raw = frames[0].reported;
  frames[0].raw_covariance = nan * Matrix6d::Identity();
  const ObjectMetrics m = evaluateObject(frames, boxModel());
  EXPECT_EQ(*m.success_5cm_5deg, 0.5);
  EXPECT_EQ(*m.false_claim_ratio, 0.5);
  EXPECT_FALSE(m.tracker_nees);
  ObjectMetrics::visit(m, [](const char* name, const auto& field) {
    if (field) {
      EXPECT_TRUE(std::isfinite(static_cast<double>(*field))) << name;
    }
  });
}

TEST(Symmetry, DiscretePoseNearestToTheEstimateIsTaken) {
  Symmetries symmetries;
  symmetries.discrete.push_back({expSO3({0, 0, std::numbers::pi}), Vector3d::Zero()});
  EXPECT_THAT(nearestSymmetricPose(shifted(0, 179), shifted(0), symmetries),
              PoseNear(shifted(0, 180), 1e-12, 1e-9));
  EXPECT_THAT(nearestSymmetricPose(shifted(0, 89), shifted(0), symmetries),
              PoseNear(shifted(0), 1e-12, 1e-9));

  ObjectModel model = boxModel();
  model.symmetries = symmetries;
  const std::vector<ObjectFrame> frames{frame(0.001, 180)};
  const ObjectMetrics m = evaluateObject(frames, model);
  EXPECT_NEAR(*m.mean_error_rad, 0, 1e-7);
  EXPECT_NEAR(*m.success_1cm_1deg, 1, 0);
  EXPECT_NEAR(*m.add_auc_10cm, 1 - 0.001 / 0.1, 1e-6);  // ADD-S
}

TEST(Symmetry, RotationAboutTheAxisIsFree) {
  Symmetries symmetries;
  symmetries.axis = Vector3d::UnitY();
  Numbers numbers(1);
  for (int i = 0; i < 50; ++i) {
    const SE3 truth = numbers.pose(1);
    const SE3 turn{expSO3({0, numbers.uniform(-3.1, 3.1), 0}), Vector3d::Zero()};
    const SE3 tilt{expSO3({0.1, 0, 0}), Vector3d(0.01, 0, 0)};
    const SE3 estimate = truth * turn * tilt;
    const SE3 nearest = nearestSymmetricPose(estimate, truth, symmetries);
    const PoseError error = poseError(estimate, nearest);
    EXPECT_NEAR(error.rotation_rad, 0.1, 1e-9);
    EXPECT_NEAR(error.translation_m, 0.01, 1e-9);
    // No other turn comes nearer.
    for (double angle : {-0.1, 0.1}) {
      const SE3 other = nearest * SE3{expSO3({0, angle, 0}), Vector3d::Zero()};
      EXPECT_GT(poseError(estimate, other).rotation_rad, error.rotation_rad);
    }
  }
}

// A symmetry whose centre is not the object's origin moves the origin.
TEST(Symmetry, OffsetSymmetry) {
  Symmetries symmetries;
  symmetries.discrete.push_back({expSO3({0, 0, std::numbers::pi}), Vector3d(0.2, 0, 0)});
  const SE3 truth = shifted(0.5, 30);
  const SE3 twin = truth * symmetries.discrete[0];
  EXPECT_THAT(nearestSymmetricPose(twin, truth, symmetries), PoseNear(twin, 1e-12, 1e-7));
}

TEST(NormalisedError, IsSixOnAverageForTheStatedCovariance) {
  Numbers numbers(2);
  double sum = 0;
  constexpr int runs = 4000;
  Vector6d sigma;
  sigma << 0.01, 0.02, 0.03, 0.001, 0.002, 0.003;
  for (int i = 0; i < runs; ++i) {
    const SE3 estimate = numbers.pose(1);
    const SE3 truth = estimate * exp(Vector6d(sigma.cwiseProduct(numbers.normal6())));
    sum += normalisedError(estimate, Matrix6d(sigma.cwiseAbs2().asDiagonal()), truth).value();
  }
  EXPECT_NEAR(sum / runs, 6, 4 * std::sqrt(12.0 / runs));
  EXPECT_FALSE(normalisedError({}, Matrix6d::Zero(), {}));
  EXPECT_FALSE(normalisedError({}, -Matrix6d::Identity(), {}));
}

TEST(MapErrors, AreThoseOfTheObjectInTheStartFrame) {
  ObjectMetrics m;
  ObjectEstimate estimate{"o", shifted(0.02, 2), 1e-4 * Matrix6d::Identity()};
  evaluateMap(estimate, shifted(0, 2), {}, m);
  EXPECT_NEAR(*m.map_error_m, 0.02, 1e-12);
  EXPECT_NEAR(*m.map_error_rad, 0, 1e-9);
  EXPECT_NEAR(*m.map_nees, 4, 1e-9);
}

}  // namespace
}  // namespace diorama
