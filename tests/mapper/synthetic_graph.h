// A camera on a wavy orbit around some objects, measured with white noise.
#pragma once

#include <vector>

#include "core/measurements.h"
#include "core/trajectory.h"
#include "mapper/mapper.h"
#include "tests/support/matchers.h"

namespace diorama::test {

struct SyntheticOptions {
  int poses = 300;
  int objects = 1;
  double visible = 1;                  // share of frames in which an object is measured
  int hidden_from = 0, hidden_to = 0;  // nothing is measured in these frames
  double odometry_sigma_m = 2e-4, odometry_sigma_rad = 3e-4;
  double object_sigma_m = 1e-3, object_sigma_rad = 3e-3;
  bool noise = true;
};

struct SyntheticGraph {
  Trajectory truth;  // in the first camera's frame
  std::vector<SE3> objects;
  std::vector<OdometryMeasurement> odometry;                 // [k] from k to k + 1
  std::vector<std::vector<ObjectMeasurement>> observations;  // [k] at k

  SE3 camera(size_t k) const { return truth.poses[k].pose; }
};

inline Matrix6d diagonalCovariance(double sigma_m, double sigma_rad) {
  Vector6d variances;
  variances << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma_rad * sigma_rad);
  return variances.asDiagonal();
}

// A measurement of a true pose; the noise has the given covariance in the right tangent.
inline SE3 disturbed(const SE3& truth, const Matrix6d& covariance, Numbers& numbers, bool noise) {
  if (!noise) return truth;
  return truth * exp(Vector6d(covariance.diagonal().cwiseSqrt().cwiseProduct(numbers.normal6())));
}

inline SE3 orbitPose(double seconds) {
  const double angle = 0.5 * seconds, radius = 0.8 + 0.3 * std::sin(0.7 * seconds);
  const Vector3d position(radius * std::cos(angle), radius * std::sin(angle),
                          0.4 + 0.1 * std::sin(1.3 * seconds));
  const Vector3d z = (Vector3d(0, 0, 0.1) - position).normalized();
  const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
  Matrix3d R;
  R << x, z.cross(x), z;
  return {Eigen::Quaterniond(R), position};
}

// Measurements as rough as those of trackers and odometry.
inline SyntheticOptions coarse() {
  return {.poses = 600,
          .objects = 5,
          .visible = 0.6,
          .odometry_sigma_m = 4e-3,
          .odometry_sigma_rad = 2e-3,
          .object_sigma_m = 8e-3,
          .object_sigma_rad = 2e-2};
}

inline SyntheticGraph makeGraph(const SyntheticOptions& options, uint64_t seed) {
  Numbers numbers(seed);
  SyntheticGraph graph;
  const SE3 T_first_orbit = orbitPose(0).inverse();
  for (int k = 0; k < options.poses; ++k)
    graph.truth.poses.push_back({k * int64_t{33'333'000}, T_first_orbit * orbitPose(k / 30.0)});
  for (int j = 0; j < options.objects; ++j)
    graph.objects.push_back(T_first_orbit * numbers.pose(0.2));
  const Matrix6d odometry =
      diagonalCovariance(options.odometry_sigma_m, options.odometry_sigma_rad);
  const Matrix6d object = diagonalCovariance(options.object_sigma_m, options.object_sigma_rad);
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    const StampedPose& pose = graph.truth.poses[k];
    if (k > 0) {
      const StampedPose& last = graph.truth.poses[k - 1];
      const SE3 motion = last.pose.inverse() * pose.pose;
      graph.odometry.push_back({"simulated", last.timestamp_ns, pose.timestamp_ns,
                                disturbed(motion, odometry, numbers, options.noise), odometry, 1});
    }
    graph.observations.emplace_back();
    const int frame = static_cast<int>(k);
    if (frame >= options.hidden_from && frame < options.hidden_to) continue;
    for (size_t j = 0; j < graph.objects.size(); ++j) {
      if (numbers.uniform(0, 1) > options.visible) continue;
      const SE3 seen = pose.pose.inverse() * graph.objects[j];
      graph.observations[k].push_back({"edge", "object" + std::to_string(j), pose.timestamp_ns,
                                       disturbed(seen, object, numbers, options.noise), object, 1,
                                       true, ""});
    }
  }
  return graph;
}

// Feeds frame k as the pipeline does.
inline MapEstimate feed(Mapper& mapper, const SyntheticGraph& graph, size_t k) {
  if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
  if (k > 0) {
    const AddResult result = mapper.addOdometry(graph.odometry[k - 1]);
    EXPECT_TRUE(result.added) << result.reason;
  }
  for (const ObjectMeasurement& measurement : graph.observations[k]) {
    const AddResult result = mapper.addObject(measurement);
    EXPECT_TRUE(result.added || result.innovation) << result.reason;  // or outside the gate
  }
  return mapper.update();
}

inline MapEstimate feedAll(Mapper& mapper, const SyntheticGraph& graph) {
  MapEstimate estimate;
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) estimate = feed(mapper, graph, k);
  return estimate;
}

}  // namespace diorama::test
