// Paths made of paths: one after the other, shaken, or with looks away.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/errors.h"
#include "core/random.h"
#include "sim/motion_path.h"

namespace diorama {
namespace {

using Eigen::Quaterniond;

Quaterniond blend(const Quaterniond& from, const Quaterniond& to, double weight) {
  return (from * expSO3(weight * logSO3(from.conjugate() * to))).normalized();
}

// A pose that moves on with constant velocities (world for the position, body for the rotation).
struct Flight {
  SE3 start;
  Vector3d velocity_m_s, turn_rad_s;

  SE3 after(double time_s) const {
    return {start.rotation * expSO3(turn_rad_s * time_s),
            start.translation + velocity_m_s * time_s};
  }
};

// The flight that a path would go on with at a time; it is looked at on the side of `step_s` only.
Flight flightAt(const MotionPath& path, double time_s, double step_s) {
  const SE3 a = path.pose(time_s), b = path.pose(time_s + step_s),
            c = path.pose(time_s + 2 * step_s);
  const auto slope = [&](const Vector3d& to_b, const Vector3d& to_c) -> Vector3d {
    return (4 * to_b - to_c) / (2 * step_s);  // one-sided, second order
  };
  return {a, slope(b.translation - a.translation, c.translation - a.translation),
          slope(logSO3(a.rotation.conjugate() * b.rotation),
                logSO3(a.rotation.conjugate() * c.rotation))};
}

class SequencePath : public MotionPath {
 public:
  explicit SequencePath(const std::vector<Segment>& segments) {
    constexpr double kStep_s = 1e-4;
    double start_s = 0;
    for (const Segment& s : segments) {
      DIORAMA_CHECK(s.duration_s >= 1e-3 && s.join_s >= 1e-3);
      parts_.push_back(
          {s, start_s, flightAt(*s.path, 0, kStep_s), flightAt(*s.path, s.duration_s, -kStep_s)});
      start_s += s.duration_s + s.join_s;
    }
  }

  SE3 pose(double time_s) const override {
    const auto after = std::upper_bound(parts_.begin() + 1, parts_.end(), time_s,
                                        [](double t, const Part& p) { return t < p.start_s; });
    const Part& part = *(after - 1);
    const double in_join_s = time_s - part.start_s - part.segment.duration_s;
    if (in_join_s <= 0 || after == parts_.end())
      return part.segment.path->pose(time_s - part.start_s);
    const double weight = minimumJerk(in_join_s / part.segment.join_s);
    const SE3 from = part.leave.after(in_join_s), to = after->enter.after(time_s - after->start_s);
    return {blend(from.rotation, to.rotation, weight),
            from.translation + weight * (to.translation - from.translation)};
  }

 private:
  struct Part {
    Segment segment;
    double start_s;
    Flight enter, leave;
  };
  std::vector<Part> parts_;
};

class ShakenPath : public MotionPath {
 public:
  ShakenPath(MotionPathPtr path, const Shake& shake) : path_(std::move(path)) {
    const Random random(shake.seed, RandomStream::kPath);
    for (uint32_t axis = 0; axis < 6; ++axis) {
      double power = 0;
      for (size_t k = 0; k < kSines; ++k) {
        const std::array<double, 4> u = random.uniform(axis, k);
        const double octave = (static_cast<double>(k) + u[0]) / kSines;
        Sine& sine = sines_[axis][k];
        sine.rate_rad_s =
            2 * std::numbers::pi * shake.low_hz * std::pow(shake.high_hz / shake.low_hz, octave);
        sine.phase_rad = 2 * std::numbers::pi * u[1];
        sine.amplitude = 1 / sine.rate_rad_s;
        power += sine.amplitude * sine.amplitude / 2;
      }
      const double rms = axis < 3 ? shake.amplitude_m : shake.amplitude_rad;
      for (Sine& sine : sines_[axis]) sine.amplitude *= rms / std::sqrt(power);
    }
  }

  SE3 pose(double time_s) const override {
    Vector6d offset = Vector6d::Zero();
    for (size_t axis = 0; axis < 6; ++axis)
      for (const Sine& sine : sines_[axis])
        offset[static_cast<Eigen::Index>(axis)] +=
            sine.amplitude * std::sin(sine.rate_rad_s * time_s + sine.phase_rad);
    const SE3 shaken = path_->pose(time_s) * exp(offset);
    return {shaken.rotation.normalized(), shaken.translation};
  }

 private:
  static constexpr size_t kSines = 12;
  struct Sine {
    double amplitude = 0, rate_rad_s = 0, phase_rad = 0;
  };
  MotionPathPtr path_;
  std::array<std::array<Sine, kSines>, 6> sines_;
};

class GlancingPath : public MotionPath {
 public:
  GlancingPath(MotionPathPtr path, const std::vector<Glance>& glances)
      : path_(std::move(path)), glances_(glances) {}

  SE3 pose(double time_s) const override {
    SE3 pose = path_->pose(time_s);
    for (const Glance& glance : glances_) {
      const double weight = minimumJerk((time_s - glance.start_s) / glance.turn_s) *
                            minimumJerk((glance.end_s - time_s) / glance.turn_s);
      if (weight == 0) continue;
      const Quaterniond away = aimAt(glance.target)(time_s, pose.translation);
      pose.rotation = blend(pose.rotation, away, weight);
    }
    return pose;
  }

 private:
  MotionPathPtr path_;
  std::vector<Glance> glances_;
};

}  // namespace

std::unique_ptr<MotionPath> makeSequencePath(const std::vector<Segment>& segments) {
  DIORAMA_CHECK(!segments.empty());
  return std::make_unique<SequencePath>(segments);
}

std::unique_ptr<MotionPath> makeShakenPath(MotionPathPtr path, const Shake& shake) {
  DIORAMA_CHECK(shake.low_hz > 0 && shake.high_hz >= shake.low_hz);
  return std::make_unique<ShakenPath>(std::move(path), shake);
}

std::unique_ptr<MotionPath> makeGlancingPath(MotionPathPtr path,
                                             const std::vector<Glance>& glances) {
  return std::make_unique<GlancingPath>(std::move(path), glances);
}

}  // namespace diorama
