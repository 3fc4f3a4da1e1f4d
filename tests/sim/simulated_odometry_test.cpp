#include "sim/simulated_odometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/motion_path.h"

namespace diorama {
namespace {

SimulatedOdometryOptions silent() {
  SimulatedOdometryOptions options;
  options.drift_m_per_m = options.drift_rad_per_rad = options.drift_rad_per_m = 0;
  options.bias_m_per_m = options.bias_rad_s = options.noise_m = options.noise_rad = 0;
  return options;
}

// `frames` poses at 30 Hz along a line (m/s) while turning (rad/s).
Trajectory moving(int frames, double speed, double turn_rate) {
  Trajectory truth;
  for (int k = 0; k < frames; ++k) {
    const double t = k / 30.0;
    truth.poses.push_back({static_cast<int64_t>(k) * 33333000,
                           {expSO3({0.2, turn_rate * t, 0}), {speed * t, 0.1, 0.3}}});
  }
  return truth;
}

Trajectory handLike() {
  std::vector<Keyframe> keyframes;
  for (int k = 0; k < 20; ++k) {
    const double a = 0.3 * k;
    keyframes.push_back(
        {0.5 * k, lookAt({0.7 * std::cos(a), 0.8 * std::sin(a), 0.4 + 0.15 * std::sin(1.7 * k)},
                         {0, 0.05, 0.1})});
  }
  const auto path = makeSplinePath(keyframes);
  Trajectory truth;
  for (int k = 0; k < 280; ++k)
    truth.poses.push_back({static_cast<int64_t>(k) * 33333000, path->pose(k / 30.0)});
  return truth;
}

// Error of the composed motion, [rho, phi].
Vector6d endError(const Trajectory& truth, const SimulatedOdometryOptions& options, uint64_t seed) {
  const SimulatedOdometry odometry(truth, options, seed);
  const SE3 T_true = truth.poses.front().pose.inverse() * truth.poses.back().pose;
  return log(T_true.inverse() * odometry.measure(0, truth.poses.size() - 1).T_from_to);
}

TEST(SimulatedOdometry, WithoutErrorsIsTheTruth) {
  const Trajectory truth = handLike();
  EXPECT_LT(endError(truth, silent(), 1).norm(), 1e-12);
}

TEST(SimulatedOdometry, DriftsByTwoPercentOfAMetre) {
  SimulatedOdometryOptions options = silent();
  options.drift_m_per_m = 0.02;
  const int n = 2000;
  for (int frames : {16, 61}) {  // one metre in 15 or in 60 steps: the frame rate does not matter
    const Trajectory truth = moving(frames, 30.0 / (frames - 1), 0.3);
    double sum = 0;
    for (uint64_t seed = 0; seed < n; ++seed)
      sum += endError(truth, options, seed).head<3>().squaredNorm();
    EXPECT_NEAR(std::sqrt(sum / n), 0.02, 0.0008) << frames;
  }
}

TEST(SimulatedOdometry, TurnsDriftByTwoPercentOfARadian) {
  SimulatedOdometryOptions options = silent();
  options.drift_rad_per_rad = 0.02;
  const int n = 2000;
  const Trajectory truth = moving(31, 0, 1);
  double sum = 0;
  for (uint64_t seed = 0; seed < n; ++seed)
    sum += endError(truth, options, seed).tail<3>().squaredNorm();
  EXPECT_NEAR(std::sqrt(sum / n), 0.02, 0.0008);
}

TEST(SimulatedOdometry, BiasesGrowInProportion) {
  SimulatedOdometryOptions options = silent();
  options.bias_m_per_m = 0.01;
  EXPECT_NEAR(endError(moving(61, 0.5, 0), options, 1).head<3>().norm(), 0.01, 1e-9);
  options = silent();
  options.bias_rad_s = 0.003;
  EXPECT_NEAR(endError(moving(61, 0, 0), options, 1).tail<3>().norm(), 0.006, 1e-6);
}

double meanNees(const SimulatedOdometryOptions& options, size_t stride) {
  const Trajectory truth = handLike();
  double sum = 0;
  int count = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const SimulatedOdometry odometry(truth, options, seed);
    for (size_t i = 0; i + stride < truth.poses.size(); i += stride) {
      const OdometryMeasurement m = odometry.measure(i, i + stride);
      const SE3 T_true = truth.poses[i].pose.inverse() * truth.poses[i + stride].pose;
      const Vector6d e = log(T_true.inverse() * m.T_from_to);
      sum += e.dot(m.covariance.ldlt().solve(e));
      ++count;
    }
  }
  return sum / count;
}

TEST(SimulatedOdometry, CovarianceIsHonest) {
  SimulatedOdometryOptions options;
  EXPECT_NEAR(meanNees(options, 1), 6, 0.2);
  options.bias_m_per_m = options.bias_rad_s = 0;
  EXPECT_NEAR(meanNees(options, 1), 6, 0.15);
  EXPECT_NEAR(meanNees(options, 10), 6, 0.45);
}

TEST(SimulatedOdometry, NoiseOfAFrameDoesNotDependOnTheOthers) {
  const Trajectory truth = handLike();
  const auto frame = [&](size_t k) {
    Frame frame;
    frame.timestamp_ns = truth.poses[k].timestamp_ns;
    return frame;
  };
  SimulatedOdometry all(truth, {}, 5), some(truth, {}, 5), other(truth, {}, 6);
  EXPECT_FALSE(all.track(frame(0)).has_value());
  for (size_t k = 1; k < 40; ++k) all.track(frame(k));
  EXPECT_FALSE(some.track(frame(39)).has_value());
  const auto a = all.track(frame(40)), b = some.track(frame(40));
  EXPECT_EQ(a->T_from_to.translation, b->T_from_to.translation);
  EXPECT_EQ(a->covariance, b->covariance);
  other.track(frame(39));
  EXPECT_NE(a->T_from_to.translation, other.track(frame(40))->T_from_to.translation);
  EXPECT_EQ(a->from_ns, truth.poses[39].timestamp_ns);
  EXPECT_EQ(a->source, "simulated");
}

TEST(SimulatedOdometry, ATimeThatIsNotInTheTruthHasNoHealth) {
  const Trajectory truth = handLike();
  SimulatedOdometry odometry(truth, {}, 5);
  Frame frame;
  odometry.track(frame);
  frame.timestamp_ns = 12345678;
  EXPECT_EQ(odometry.track(frame)->health, 0);
}

}  // namespace
}  // namespace diorama
