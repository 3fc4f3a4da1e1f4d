// What an inertial sensor in the camera feels: angular velocity and specific force along a path,
// disturbed by white noise and by biases that walk.
//
// The model is that of P. Furgale, J. Rehder and R. Siegwart (Kalibr, "IMU noise model"):
//   w = w_true + b_g + n_g,   a = R^T (p'' - g) + b_a + n_a,   db/dt = white,
// sampled with sigma(n) = density * sqrt(rate) and, from sample to sample, sigma(b) = walk /
// sqrt(rate).
#pragma once

#include <cstdint>
#include <vector>

#include "core/options.h"
#include "sim/motion_path.h"

namespace diorama {

// Scene key `imu`; the densities are those of the ADIS16448 in the EuRoC data set.
struct ImuOptions {
  double rate_hz = 200;
  double gyroscope_noise_density = 1.6968e-4;  // rad / s / sqrt(Hz)
  double gyroscope_random_walk = 1.9393e-5;    // rad / s^2 / sqrt(Hz)
  double accelerometer_noise_density = 2e-3;   // m / s^2 / sqrt(Hz)
  double accelerometer_random_walk = 3e-3;     // m / s^3 / sqrt(Hz)
  double gravity_m_s2 = 9.81;                  // along the world's -z
  template <class V>
  void visit(V& v) {
    v("rate_hz", rate_hz, Range{1, 10000});
    v("gyroscope_noise_density", gyroscope_noise_density, kNotNegative);
    v("gyroscope_random_walk", gyroscope_random_walk, kNotNegative);
    v("accelerometer_noise_density", accelerometer_noise_density, kNotNegative);
    v("accelerometer_random_walk", accelerometer_random_walk, kNotNegative);
    v("gravity_m_s2", gravity_m_s2, kNotNegative);
  }
};

struct ImuSample {
  int64_t timestamp_ns = 0;
  Vector3d gyroscope;      // rad/s, in the camera frame
  Vector3d accelerometer;  // m/s^2, specific force in the camera frame
  // What is true at this moment.
  SE3 T_world_camera;
  Vector3d velocity;  // m/s, world
  Vector3d gyroscope_bias, accelerometer_bias;
};

// Motion at a time, from the path by differences of second order over a millisecond.
struct PathMotion {
  SE3 T_world_camera;
  Vector3d velocity;          // m/s, world
  Vector3d acceleration;      // m/s^2, world
  Vector3d angular_velocity;  // rad/s, camera frame
};
// Within [begin_s, end_s]: outside of it the path may stand still.
PathMotion motionAt(const MotionPath& path, double time_s, double begin_s, double end_s);

// Samples at whole multiples of the period that span the two times: from the last one that is not
// after `first_ns` to the first one that is not before `last_ns`. The path is known from 0 to
// `end_s`. A sample depends on the seed and its number only, whatever the range.
std::vector<ImuSample> simulateImu(const MotionPath& path, double end_s, const ImuOptions& options,
                                   uint64_t seed, int64_t first_ns, int64_t last_ns);

}  // namespace diorama
