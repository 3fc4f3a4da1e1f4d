// Measurements that are wrong, extreme, or none.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "mapper/mapper.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kDegree = 3.14159265358979323846 / 180;

TEST(Mapper, WrongMeasurementsAreOutweighed) {
  for (const char* kernel : {"huber", "cauchy", "cauchy_tail"}) {
    SyntheticGraph graph = makeGraph({.poses = 300}, 7);
    Numbers numbers(8);
    int wrong = 0;
    for (size_t k = 20; k < 300; ++k) {
      if (numbers.uniform(0, 1) > 0.2) continue;
      ++wrong;
      SE3& Z = graph.observations[k].front().T_camera_object;
      Z = Z * exp(Vector6d(0.1 * numbers.normal6()));
    }
    ASSERT_GT(wrong, 30);
    MapperOptions options;
    options.object_kernel = kernel;
    Mapper mapper(options);
    feedAll(mapper, graph);
    const MapEstimate estimate = mapper.finish();
    EXPECT_THAT(estimate.objects.front().T_world_object,
                PoseNear(graph.objects[0], 2e-3, 0.2 * kDegree))
        << kernel;
    EXPECT_THAT(estimate.T_world_camera,
                PoseNear(graph.truth.poses.back().pose, 3e-3, 0.3 * kDegree))
        << kernel;
  }
}

// A tracker that sits on something else for a second, and says that it is sure.
TEST(Mapper, BurstOfWrongMeasurementsIsOutweighed) {
  SyntheticGraph graph = makeGraph({.poses = 300}, 9);
  for (size_t k = 150; k < 180; ++k) {
    SE3& Z = graph.observations[k].front().T_camera_object;
    Z.translation.x() += 0.08;
  }
  Mapper mapper;
  MapEstimate estimate;
  double worst = 0;
  for (size_t k = 0; k < 300; ++k) {
    estimate = feed(mapper, graph, k);
    worst =
        std::max(worst, (estimate.T_world_camera.translation - graph.camera(k).translation).norm());
  }
  std::printf("burst: worst camera error %.2f mm\n", 1e3 * worst);
  EXPECT_LT(worst, 0.02);
  EXPECT_THAT(estimate.objects.front().T_world_object,
              PoseNear(graph.objects[0], 2e-3, 0.2 * kDegree));
}

// Twenty and a hundred standard deviations off, in the measurement that places the object.
TEST(Mapper, WrongFirstMeasurementIsOutvoted) {
  for (const char* kernel : {"huber", "cauchy_tail"}) {
    for (double off_m : {0.02, 0.1}) {
      SyntheticGraph graph = makeGraph({.poses = 100}, 5);
      graph.observations[0].front().T_camera_object.translation.x() += off_m;
      MapperOptions options;
      options.object_kernel = kernel;
      Mapper mapper(options);
      EXPECT_THAT(feedAll(mapper, graph).objects.front().T_world_object,
                  PoseNear(graph.objects[0], 4e-3, 0.5 * kDegree))
          << kernel << " " << off_m;
    }
  }
}

TEST(Mapper, RefusesWhatIsNotAMeasurement) {
  const SyntheticGraph graph = makeGraph({.poses = 10}, 6);
  Mapper mapper;
  EXPECT_FALSE(mapper.addOdometry(graph.odometry[0]));  // not started
  EXPECT_FALSE(mapper.addGap(1));
  EXPECT_FALSE(mapper.addObject(graph.observations[0][0]));
  for (size_t k = 0; k < 5; ++k) feed(mapper, graph, k);
  const MapEstimate before = mapper.estimate();
  const double nan = std::numeric_limits<double>::quiet_NaN();

  const auto refusesOdometry = [&](auto change) {
    OdometryMeasurement m = graph.odometry[4];
    change(m);
    const AddResult result = mapper.addOdometry(m);
    return !result.added && !result.reason.empty();
  };
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.T_from_to.translation.x() = nan; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.T_from_to.rotation.coeffs().setZero(); }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.covariance(2, 2) = nan; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.covariance(2, 2) = -1; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.covariance(0, 1) = 1e-5; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.covariance.setZero(); }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.covariance *= 1e300; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.health = 0; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.health = nan; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.from_ns += 1; }));
  EXPECT_TRUE(refusesOdometry([&](auto& m) { m.to_ns = m.from_ns; }));

  const auto refusesObject = [&](auto change) {
    ObjectMeasurement m = graph.observations[4][0];
    change(m);
    const AddResult result = mapper.addObject(m);
    return !result.added && !result.reason.empty();
  };
  EXPECT_TRUE(refusesObject([&](auto& m) { m.T_camera_object.translation.y() = nan; }));
  EXPECT_TRUE(refusesObject([&](auto& m) { m.covariance(5, 5) = 0; }));
  EXPECT_TRUE(refusesObject([&](auto& m) { m.covariance(5, 5) = nan; }));
  EXPECT_TRUE(refusesObject([&](auto& m) { m.claimed = false; }));
  EXPECT_TRUE(refusesObject([&](auto& m) { m.timestamp_ns += 1; }));
  EXPECT_TRUE(refusesObject([&](auto& m) { m.object = "new", m.covariance(0, 0) = nan; }));

  const MapEstimate after = mapper.estimate();
  EXPECT_THAT(after.T_world_camera, PoseNear(before.T_world_camera, 1e-15, 1e-15));
  EXPECT_EQ(after.objects.size(), before.objects.size());
  EXPECT_FALSE(mapper.predict("new"));
}

TEST(Mapper, ExtremeCovariancesStayFinite) {
  SyntheticGraph graph = makeGraph({.poses = 80, .noise = false}, 11);
  for (size_t k = 0; k < graph.odometry.size(); ++k)
    graph.odometry[k].covariance *= k % 2 ? 1e-12 : 1e10;
  for (size_t k = 0; k < graph.observations.size(); ++k)
    graph.observations[k][0].covariance *= k % 3 ? 1e-10 : 1e8;
  Mapper mapper;
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    const MapEstimate estimate = feed(mapper, graph, k);
    ASSERT_TRUE(estimate.T_world_camera.isFinite());
    ASSERT_TRUE(estimate.objects[0].T_world_object.isFinite());
    ASSERT_TRUE(estimate.objects[0].covariance.allFinite());
  }
  EXPECT_THAT(mapper.finish().T_world_camera, PoseNear(graph.camera(79), 1e-4, 1e-4));
}

}  // namespace
}  // namespace diorama
