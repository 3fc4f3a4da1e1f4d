#include "mapper/mapper.h"

#include <gtest/gtest.h>

#include <cmath>

#include <ctime>

#include "core/text.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kDegree = 3.14159265358979323846 / 180;

TEST(Mapper, NoiseFreeMeasurementsGiveTheTruth) {
  SyntheticOptions options;
  options.objects = 2;
  options.visible = 0.6;
  options.noise = false;
  const SyntheticGraph graph = makeGraph(options, 1);
  Mapper mapper;
  const MapEstimate estimate = feedAll(mapper, graph);
  EXPECT_THAT(estimate.T_world_camera, PoseNear(graph.truth.poses.back().pose, 1e-9, 1e-9));
  ASSERT_EQ(estimate.objects.size(), 2u);
  for (const ObjectEstimate& object : estimate.objects) {
    const size_t j = object.name == "object0" ? 0 : 1;
    EXPECT_THAT(object.T_world_object, PoseNear(graph.objects[j], 1e-9, 1e-9));
  }
  mapper.finish();
  const Trajectory trajectory = mapper.smoothedTrajectory();
  ASSERT_EQ(trajectory.poses.size(), graph.truth.poses.size());
  for (size_t k = 0; k < trajectory.poses.size(); ++k)
    EXPECT_THAT(trajectory.poses[k].pose, PoseNear(graph.camera(k), 1e-9, 1e-9));
}

TEST(Mapper, NoisyMeasurementsAreAveraged) {
  const SyntheticGraph graph = makeGraph({.poses = 600, .objects = 3, .visible = 0.6}, 2);
  Mapper mapper;
  feedAll(mapper, graph);
  const MapEstimate estimate = mapper.finish();
  for (const ObjectEstimate& object : estimate.objects) {
    const size_t j = static_cast<size_t>(object.name.back() - '0');
    EXPECT_THAT(object.T_world_object, PoseNear(graph.objects[j], 1.5e-3, 0.2 * kDegree));
  }
  double worst = 0;
  const Trajectory trajectory = mapper.smoothedTrajectory();
  for (size_t k = 0; k < trajectory.poses.size(); ++k)
    worst = std::max(worst,
                     (trajectory.poses[k].pose.translation - graph.camera(k).translation).norm());
  EXPECT_LT(worst, 4e-3);
}

struct Difference {
  double translation_m = 0, rotation_rad = 0;
};

// How far the online belief at the last frame is from the optimum over everything.
Difference onlineMinusBatch(const SyntheticGraph& graph, const MapperOptions& options) {
  Mapper mapper(options);
  const MapEstimate online = feedAll(mapper, graph);
  const MapEstimate batch = mapper.finish();
  Difference most;
  const auto compare = [&](const SE3& a, const SE3& b) {
    most.translation_m = std::max(most.translation_m, (a.translation - b.translation).norm());
    most.rotation_rad = std::max(most.rotation_rad, angleBetween(a.rotation, b.rotation));
  };
  compare(online.T_world_camera, batch.T_world_camera);
  for (size_t j = 0; j < batch.objects.size(); ++j)
    compare(online.objects[j].T_world_object, batch.objects[j].T_world_object);
  return most;
}

TEST(Mapper, OnlineIsNearTheBatchOptimum) {
  struct Case {
    const char* name;
    SyntheticOptions options;
  };
  SyntheticOptions absent{.poses = 400, .hidden_from = 120, .hidden_to = 330};
  SyntheticOptions drifting = absent;
  drifting.odometry_sigma_m = 2e-3;
  drifting.odometry_sigma_rad = 3e-3;
  const Case cases[] = {
      {"always seen", {.poses = 300}},
      {"three objects", {.poses = 300, .objects = 3, .visible = 0.5}},
      {"absent for 7 s", absent},
      {"absent, bad odometry", drifting},
      {"coarse tracker", {.poses = 300, .object_sigma_m = 5e-3, .object_sigma_rad = 2e-2}}};
  for (const Case& c : cases) {
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      const Difference most = onlineMinusBatch(makeGraph(c.options, seed), {});
      std::printf("%s, seed %d: %.4f mm, %.5f deg\n", c.name, static_cast<int>(seed),
                  1e3 * most.translation_m, most.rotation_rad / kDegree);
      EXPECT_LT(most.translation_m, 1e-4) << c.name;
      EXPECT_LT(most.rotation_rad, 0.01 * kDegree) << c.name;
    }
  }
}

double normalised(const SE3& estimate, const Matrix6d& P, const SE3& truth) {
  const Vector6d e = log(estimate.inverse() * truth);
  return e.dot(P.inverse() * e);
}

// With white noise of the stated covariance, e^T P^-1 e averages 6.
TEST(Mapper, CovariancesAreConsistent) {
  double map = 0, prediction = 0, finished = 0;
  constexpr int runs = 40;
  for (uint64_t seed = 1; seed <= runs; ++seed) {
    const SyntheticGraph graph = makeGraph({.poses = 60, .hidden_from = 40, .hidden_to = 60}, seed);
    Mapper mapper;
    const MapEstimate estimate = feedAll(mapper, graph);
    const ObjectEstimate& object = estimate.objects.front();
    map += normalised(object.T_world_object, object.covariance, graph.objects[0]) / runs;
    const ObjectPrediction predicted = mapper.predict("object0").value();
    prediction += normalised(predicted.T_camera_object, predicted.covariance,
                             graph.truth.poses.back().pose.inverse() * graph.objects[0]) /
                  runs;
    const ObjectEstimate last = mapper.finish().objects.front();
    finished += normalised(last.T_world_object, last.covariance, graph.objects[0]) / runs;
  }
  std::printf("normalised errors: map %.2f, prediction %.2f, finished %.2f\n", map, prediction,
              finished);
  // 6 +- 4 standard deviations of the mean of chi-square(6), sqrt(12 / runs).
  for (double mean : {map, prediction, finished}) EXPECT_NEAR(mean, 6, 4 * std::sqrt(12.0 / runs));
}

TEST(Mapper, PredictsAnObjectThatIsNotMeasured) {
  const SyntheticGraph graph = makeGraph({.poses = 250, .hidden_from = 100, .hidden_to = 250}, 3);
  Mapper mapper;
  for (size_t k = 0; k < 100; ++k) feed(mapper, graph, k);
  const double seen_trace = mapper.predict("object0").value().covariance.trace();
  for (size_t k = 100; k < 250; ++k) feed(mapper, graph, k);
  const ObjectPrediction prediction = mapper.predict("object0").value();
  EXPECT_THAT(
      prediction.T_camera_object,
      PoseNear(graph.truth.poses.back().pose.inverse() * graph.objects[0], 0.02, 2 * kDegree));
  EXPECT_GT(prediction.covariance.trace(), 2 * seen_trace);  // odometry drifts
  EXPECT_FALSE(mapper.predict("object1"));
}

// The odometry of a frame is enough to say where the object is expected in it.
TEST(Mapper, PredictsRightAfterOdometry) {
  const SyntheticGraph graph = makeGraph({.poses = 100}, 4);
  Mapper mapper;
  for (size_t k = 0; k < 99; ++k) feed(mapper, graph, k);
  ASSERT_TRUE(mapper.addOdometry(graph.odometry[98]));
  EXPECT_THAT(mapper.predict("object0").value().T_camera_object,
              PoseNear(graph.camera(99).inverse() * graph.objects[0], 2e-3, 0.3 * kDegree));
}

TEST(Mapper, ObjectBridgesAGapInTheOdometry) {
  const SyntheticGraph graph = makeGraph({.poses = 120}, 5);
  Mapper mapper;
  for (size_t k = 0; k < 60; ++k) feed(mapper, graph, k);
  for (size_t k = 60; k < 70; ++k) {
    ASSERT_TRUE(mapper.addGap(graph.truth.poses[k].timestamp_ns));
    ASSERT_TRUE(mapper.addObject(graph.observations[k].front()));
    EXPECT_THAT(mapper.update().T_world_camera, PoseNear(graph.camera(k), 0.02, 0.03));
  }
  MapEstimate estimate;
  for (size_t k = 70; k < 120; ++k) estimate = feed(mapper, graph, k);
  EXPECT_THAT(estimate.T_world_camera, PoseNear(graph.camera(119), 2e-3, 0.3 * kDegree));
}

// However long there is no odometry: while an object is seen the camera may go on moving. The
// object is measured as roughly as beside the visual odometry, whose map has more weight.
TEST(Mapper, ObjectsAloneHoldAMovingCamera) {
  const SyntheticGraph graph =
      makeGraph({.poses = 240, .object_sigma_m = 6e-3, .object_sigma_rad = 0.04}, 7);
  Mapper mapper;
  mapper.start(graph.truth.poses[0].timestamp_ns);
  for (size_t k = 0; k < 240; ++k) {
    if (k > 0) {
      ASSERT_TRUE(mapper.addGap(graph.truth.poses[k].timestamp_ns));
    }
    ASSERT_TRUE(mapper.addObject(graph.observations[k].front())) << k;
    mapper.update();
    EXPECT_THAT(mapper.predict("object0").value().T_camera_object,
                PoseNear(graph.camera(k).inverse() * graph.objects[0], 0.04, 9 * kDegree))
        << k;
  }
}

// Who moves keeps moving: at a pace of v nobody is sqrt(n) steps away after n frames.
TEST(Mapper, ALongGapLeavesThePlaceOpenByItsLength) {
  const SyntheticGraph graph = makeGraph({.poses = 120}, 5);
  Mapper mapper;
  for (size_t k = 0; k < 60; ++k) feed(mapper, graph, k);
  const int64_t began_ns = graph.truth.poses[59].timestamp_ns;
  for (size_t k = 60; k < 90; ++k) {
    const int64_t now_ns = graph.truth.poses[k].timestamp_ns;
    ASSERT_TRUE(mapper.addGap(now_ns));
    const Matrix6d P = mapper.predict("object0").value().covariance;
    const double expected_m =
        MapperOptions{}.gap_m_s * 1e-9 * static_cast<double>(now_ns - began_ns);
    EXPECT_GT(std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), 0.9 * expected_m);
  }
}

TEST(Mapper, OdometryAcrossAGapClosesIt) {
  const SyntheticGraph graph = makeGraph({.poses = 120, .noise = false}, 5);
  const auto at_ns = [&](size_t k) { return graph.truth.poses[k].timestamp_ns; };
  const auto truth = [&](size_t k) { return graph.truth.poses[k].pose; };
  Mapper mapper;
  for (size_t k = 0; k < 60; ++k) feed(mapper, graph, k);
  for (size_t k = 60; k < 90; ++k) ASSERT_TRUE(mapper.addGap(at_ns(k)));
  OdometryMeasurement across{"odometry",
                             at_ns(59),
                             at_ns(90),
                             truth(59).inverse() * truth(90),
                             diagonalCovariance(1e-3, 1e-3),
                             1};
  OdometryMeasurement stray = across;
  stray.from_ns = at_ns(58);
  EXPECT_FALSE(mapper.addOdometry(stray));
  ASSERT_TRUE(mapper.addOdometry(across));
  EXPECT_THAT(mapper.update().T_world_camera, PoseNear(graph.camera(90), 1e-5, 1e-5));
  const Matrix6d P = mapper.predict("object0").value().covariance;
  EXPECT_LT(std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), 0.01);
  across.from_ns = at_ns(59);
  across.to_ns = at_ns(91);
  EXPECT_FALSE(mapper.addOdometry(across));  // the gap is closed
  EXPECT_THAT(mapper.finish().T_world_camera, PoseNear(graph.camera(90), 1e-5, 1e-5));
  EXPECT_EQ(mapper.estimate().objects.size(), graph.objects.size());
}

// As when a lens is covered again and again: what holds the ends of gaps does not pile up.
TEST(Mapper, ManyGapsAreClosed) {
  const SyntheticGraph graph = makeGraph({.poses = 240, .noise = false}, 6);
  const auto at_ns = [&](size_t k) { return graph.truth.poses[k].timestamp_ns; };
  Mapper mapper;
  feed(mapper, graph, 0);
  for (size_t k = 1; k < 240; ++k) {
    if (k % 4 == 2) {
      ASSERT_TRUE(mapper.addGap(at_ns(k), {Eigen::Quaterniond(0, 0, 0, 0), Vector3d::Zero()}));
    } else {
      const size_t from = k % 4 == 3 ? k - 2 : k - 1;
      const SE3 step = graph.truth.poses[from].pose.inverse() * graph.truth.poses[k].pose;
      ASSERT_TRUE(mapper.addOdometry(
          {"odometry", at_ns(from), at_ns(k), step, diagonalCovariance(1e-3, 1e-3), 1}));
      for (const ObjectMeasurement& m : graph.observations[k]) ASSERT_TRUE(mapper.addObject(m));
    }
    const SE3 T_world_camera = mapper.update().T_world_camera;
    if (k % 4 != 2) {
      EXPECT_THAT(T_world_camera, PoseNear(graph.camera(k), 1e-3, 1e-3)) << k;
    }
  }
  EXPECT_THAT(mapper.finish().T_world_camera, PoseNear(graph.camera(239), 1e-5, 1e-5));
}

TEST(Mapper, IsRepeatableToTheLastDigit) {
  const SyntheticGraph graph = makeGraph({.poses = 150, .objects = 2, .visible = 0.5}, 12);
  std::string texts[2];
  for (std::string& text : texts) {
    Mapper mapper;
    for (size_t k = 0; k < graph.truth.poses.size(); ++k)
      text += formatPose(feed(mapper, graph, k).T_world_camera, ' ') + "\n";
    mapper.finish();
    text += toTum(mapper.smoothedTrajectory());
  }
  EXPECT_EQ(texts[0], texts[1]);
}

TEST(Mapper, StartBeginsAnew) {
  const SyntheticGraph graph = makeGraph({.poses = 40}, 13);
  Mapper mapper;
  EXPECT_FALSE(mapper.started());
  const MapEstimate first = feedAll(mapper, graph);
  const MapEstimate second = feedAll(mapper, graph);
  EXPECT_EQ(formatPose(first.T_world_camera, ' '), formatPose(second.T_world_camera, ' '));
  EXPECT_EQ(mapper.smoothedTrajectory().poses.size(), 40u);
}

// 30 s of video in less than 10 s of processor time.
TEST(Mapper, NineHundredFramesAreFast) {
  const SyntheticGraph graph = makeGraph(
      {.poses = 900, .objects = 3, .visible = 0.6, .hidden_from = 300, .hidden_to = 450}, 14);
  const auto begin = std::clock();
  Mapper mapper;
  feedAll(mapper, graph);
  const auto middle = std::clock();
  mapper.finish();
  const auto end = std::clock();
  const double online = static_cast<double>(middle - begin) / CLOCKS_PER_SEC;
  std::printf("900 frames, 3 objects: %.2f s online, %.2f s to finish\n", online,
              static_cast<double>(end - middle) / CLOCKS_PER_SEC);
  EXPECT_LT(online, 10);
}

}  // namespace
}  // namespace diorama
