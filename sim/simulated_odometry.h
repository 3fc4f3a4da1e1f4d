// An odometry sensor that drifts like a real one: the true motion from frame to frame, disturbed.
//
// For each step of the true trajectory with length l (m), turn a (rad) and time dt (s) the sensor
// measures T_from_to = T_true * Exp([rho, phi]) with
//   rho = bias_m_per_m * R_true^T t_true + n_rho,   phi = bias_rad_s * dt * e_y + n_phi,
//   var(n_rho) per axis = drift_m_per_m^2 * l / 3 + noise_m^2,
//   var(n_phi) per axis = (drift_rad_per_rad^2 * a + drift_rad_per_m^2 * l) / 3 + noise_rad^2,
// so that the drift is a random walk whose 3D error has the standard deviation `drift_m_per_m`
// after one metre of path and `drift_rad_per_rad` after one radian, for any frame rate (a step of l
// metres gets the share l of the variance). The two biases are constant and enter the covariance as
// if they were random.
#pragma once

#include <optional>
#include <string>

#include "core/odometry.h"
#include "core/random.h"
#include "core/trajectory.h"
#include "sim/scene.h"

namespace diorama {

class SimulatedOdometry : public Odometry {
 public:
  // `truth` holds T_world_camera of every frame. The noise of a step is a function of the seed and
  // of the step's number in `truth`, whichever frames are asked for.
  SimulatedOdometry(Trajectory truth, const SimulatedOdometryOptions& options, uint64_t seed,
                    std::string name = "simulated");

  // The motion since the previous call's frame; nothing for the first. Frames that were left out
  // are composed. A frame whose time is not in `truth` (to 1 microsecond) has health 0.
  std::optional<OdometryMeasurement> track(const Frame& frame) override;

  // The measurement between two poses of `truth`, from < to.
  OdometryMeasurement measure(size_t from, size_t to) const;

 private:
  struct Step {
    SE3 T_from_to;
    Matrix6d covariance;
  };
  Step step(size_t to) const;
  std::optional<size_t> find(int64_t timestamp_ns) const;

  Trajectory truth_;
  SimulatedOdometryOptions options_;
  Random random_;
  std::string name_;
  std::optional<int64_t> previous_ns_;
};

// T_world_camera of every frame of a scene.
Trajectory trueCameraPath(const Scene& scene);

}  // namespace diorama
