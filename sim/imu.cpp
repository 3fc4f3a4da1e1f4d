#include "sim/imu.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.h"

namespace diorama {
namespace {

constexpr double kStep_s = 5e-4;  // of the differences; small against any motion of a hand

Vector3d firstThree(const std::array<double, 4>& n) { return {n[0], n[1], n[2]}; }

// Numbers of a sample: independent white noise, and the steps of the biases.
struct Noise {
  Vector3d gyroscope, accelerometer, gyroscope_step, accelerometer_step;
};

Noise noiseOf(const Random& random, uint32_t sample) {
  return {firstThree(random.normal(sample, 0)), firstThree(random.normal(sample, 1)),
          firstThree(random.normal(sample, 2)), firstThree(random.normal(sample, 3))};
}

}  // namespace

PathMotion motionAt(const MotionPath& path, double time_s, double begin_s, double end_s) {
  PathMotion motion;
  motion.T_world_camera = path.pose(time_s);
  // At the very ends the differences are taken a step further inside.
  const double t = std::max(begin_s + kStep_s, std::min(time_s, end_s - kStep_s));
  const SE3 before = path.pose(t - kStep_s), now = path.pose(t), after = path.pose(t + kStep_s);
  motion.acceleration =
      (after.translation - 2 * now.translation + before.translation) / (kStep_s * kStep_s);
  motion.velocity =
      (after.translation - before.translation) / (2 * kStep_s) + (time_s - t) * motion.acceleration;
  motion.angular_velocity = logSO3(before.rotation.conjugate() * after.rotation) / (2 * kStep_s);
  return motion;
}

std::vector<ImuSample> simulateImu(const MotionPath& path, double end_s, const ImuOptions& options,
                                   uint64_t seed, int64_t first_ns, int64_t last_ns) {
  const Random random(seed, RandomStream::kImu);
  const double period_s = 1 / options.rate_hz, root = std::sqrt(options.rate_hz);
  const Vector3d up(0, 0, options.gravity_m_s2);
  Vector3d gyroscope_bias = Vector3d::Zero(), accelerometer_bias = Vector3d::Zero();
  std::vector<ImuSample> samples;
  for (uint32_t i = 0;; ++i) {
    const int64_t time_ns = std::llround(1e9 * i * period_s);
    const Noise noise = noiseOf(random, i);
    if (i > 0) {
      gyroscope_bias += options.gyroscope_random_walk / root * noise.gyroscope_step;
      accelerometer_bias += options.accelerometer_random_walk / root * noise.accelerometer_step;
    }
    if (std::llround(1e9 * (i + 1.0) * period_s) <= first_ns) continue;
    const PathMotion motion = motionAt(path, 1e-9 * static_cast<double>(time_ns), 0, end_s);
    ImuSample sample;
    sample.timestamp_ns = time_ns;
    sample.T_world_camera = motion.T_world_camera;
    sample.velocity = motion.velocity;
    sample.gyroscope_bias = gyroscope_bias;
    sample.accelerometer_bias = accelerometer_bias;
    sample.gyroscope = motion.angular_velocity + gyroscope_bias +
                       options.gyroscope_noise_density * root * noise.gyroscope;
    sample.accelerometer = motion.T_world_camera.rotation.conjugate() * (motion.acceleration + up) +
                           accelerometer_bias +
                           options.accelerometer_noise_density * root * noise.accelerometer;
    samples.push_back(sample);
    if (time_ns >= last_ns) return samples;
  }
}

}  // namespace diorama
