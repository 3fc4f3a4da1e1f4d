#include "sim/simulated_odometry.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/errors.h"

namespace diorama {

SimulatedOdometry::SimulatedOdometry(Trajectory truth, const SimulatedOdometryOptions& options,
                                     uint64_t seed, std::string name)
    : truth_(std::move(truth)),
      options_(options),
      random_(seed, RandomStream::kOdometry),
      name_(std::move(name)) {}

// The measured motion from pose to - 1 to pose `to`.
SimulatedOdometry::Step SimulatedOdometry::step(size_t to) const {
  const StampedPose& from = truth_.poses[to - 1];
  const SE3 T_true = from.pose.inverse() * truth_.poses[to].pose;
  const double dt_s = static_cast<double>(truth_.poses[to].timestamp_ns - from.timestamp_ns) * 1e-9;
  const double length_m = T_true.translation.norm();
  const double turn_rad = logSO3(T_true.rotation).norm();
  const SimulatedOdometryOptions& o = options_;
  const auto square = [](double x) { return x * x; };

  const double variance_rho = square(o.drift_m_per_m) * length_m / 3 + square(o.noise_m);
  const double variance_phi =
      (square(o.drift_rad_per_rad) * turn_rad + square(o.drift_rad_per_m) * length_m) / 3 +
      square(o.noise_rad);
  Vector6d bias;
  bias << o.bias_m_per_m * (T_true.rotation.conjugate() * T_true.translation),
      o.bias_rad_s * dt_s * Vector3d::UnitY();

  const auto a = random_.normal(static_cast<uint32_t>(to), 0);
  const auto b = random_.normal(static_cast<uint32_t>(to), 1);
  Vector6d error = bias;
  error.head<3>() += std::sqrt(variance_rho) * Vector3d(a[0], a[1], a[2]);
  error.tail<3>() += std::sqrt(variance_phi) * Vector3d(b[0], b[1], b[2]);

  Step step{T_true * exp(error), bias * bias.transpose()};
  // A sensor without any noise still claims no more than a nanometre and a nanoradian.
  constexpr double kLeastVariance = 1e-18;
  step.covariance.diagonal().head<3>().array() += std::max(variance_rho, kLeastVariance);
  step.covariance.diagonal().tail<3>().array() += std::max(variance_phi, kLeastVariance);
  return step;
}

OdometryMeasurement SimulatedOdometry::measure(size_t from, size_t to) const {
  DIORAMA_CHECK(from < to && to < truth_.poses.size());
  OdometryMeasurement m;
  m.source = name_;
  m.from_ns = truth_.poses[from].timestamp_ns;
  m.to_ns = truth_.poses[to].timestamp_ns;
  m.covariance = Matrix6d::Zero();
  m.health = 1;
  for (size_t i = from + 1; i <= to; ++i) {
    const Step next = step(i);
    const Matrix6d carry = adjoint(next.T_from_to.inverse());
    m.T_from_to = m.T_from_to * next.T_from_to;
    m.covariance = carry * m.covariance * carry.transpose() + next.covariance;
  }
  m.T_from_to.rotation.normalize();
  return m;
}

std::optional<size_t> SimulatedOdometry::find(int64_t timestamp_ns) const {
  const StampedPose* pose = truth_.nearest(timestamp_ns, 1000);
  if (pose == nullptr) return std::nullopt;
  return static_cast<size_t>(pose - truth_.poses.data());
}

std::optional<OdometryMeasurement> SimulatedOdometry::track(const Frame& frame) {
  const std::optional<int64_t> previous_ns = std::exchange(previous_ns_, frame.timestamp_ns);
  if (!previous_ns) return std::nullopt;
  const std::optional<size_t> from = find(*previous_ns), to = find(frame.timestamp_ns);
  if (from && to && *from < *to) return measure(*from, *to);
  OdometryMeasurement nothing;
  nothing.source = name_;
  nothing.from_ns = *previous_ns;
  nothing.to_ns = frame.timestamp_ns;
  return nothing;
}

Trajectory trueCameraPath(const Scene& scene) {
  Trajectory path;
  for (int k = 0; k < scene.frameCount(); ++k)
    path.poses.push_back({scene.timestampNs(k), scene.T_world_camera(k)});
  return path;
}

}  // namespace diorama
