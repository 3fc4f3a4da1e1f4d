// A room with printed walls and a pillar in it, drawn by analytic rays: a small world in which the
// odometry's truth is known.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/measurements.h"
#include "core/random.h"
#include "core/ray_query.h"
#include "core/se3.h"

namespace diorama::test {

struct TexturedRoom {
  Camera camera{CameraParameters{
      CameraModel::kRadTan, 240, 180, 200, 200, 121, 88, {-0.15, 0.04, 0.001, -0.001}}};
  double contrast = 60;  // grey levels about `brightness`
  double brightness = 120;
  double noise = 1;  // grey levels
  bool pillar = true;
  Vector3d pillar_moved = Vector3d::Zero();

  // The walls are at +-1 in x, +-0.8 in y and at 1.2 in z; the pillar stands in between.
  double greyAlong(const Vector3d& origin, const Vector3d& direction) const {
    const double wall = distanceToWalls(origin, direction);
    const double near = distanceToPillar(origin - pillar_moved, direction);
    const bool on_pillar = pillar && near < wall;
    const Vector3d p = origin + (on_pillar ? near : wall) * direction;
    return brightness + contrast * print(on_pillar ? p - pillar_moved + Vector3d(5, 5, 5) : p);
  }

  Frame draw(const SE3& T_world_camera, int index, double gain = 1, double offset = 0) const {
    Frame frame;
    frame.index = index;
    frame.timestamp_ns = index * int64_t{33333000};
    frame.gray = Image<uint8_t>(camera.width(), camera.height());
    const Matrix3d R = T_world_camera.rotationMatrix();
    const Random random(7, RandomStream::kTest);
    size_t ray = 0;
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        double sum = 0;
        for (int k = 0; k < kRays; ++k, ++ray)
          sum += greyAlong(T_world_camera.translation, R * rays()[ray]);
        const uint64_t pixel = static_cast<uint64_t>(y * camera.width() + x);
        const double disturbed = gain * sum / kRays + offset +
                                 noise * random.normal(static_cast<uint32_t>(index), pixel)[0];
        frame.gray(x, y) = static_cast<uint8_t>(std::clamp(disturbed + 0.5, 0.0, 255.0));
      }
    return frame;
  }

  // A swaying walk; the speed is about 0.25 m/s at 30 Hz.
  static SE3 path(int frame) {
    const double t = frame / 30.0;
    const Vector3d phi(0.06 * std::sin(1.3 * t), 0.10 * std::sin(0.9 * t),
                       0.05 * std::sin(0.7 * t));
    return {expSO3(phi), Vector3d(0.25 * std::sin(t), 0.12 * std::sin(0.8 * t + 0.3) - 0.035,
                                  -0.2 + 0.1 * std::sin(0.6 * t))};
  }

  static SE3 poseOfObject() { return {expSO3(Vector3d(0.3, 0.2, 0.1)), Vector3d(0.1, 0.1, 0.7)}; }
  // Where a known object is, as a tracker with 1 mm and 0.1 degrees of noise measures it.
  ObjectMeasurement measureObject(const SE3& T_world_camera, int index,
                                  const SE3& T_world_object = poseOfObject()) const {
    constexpr double sigma_m = 1e-3, sigma_rad = 1.7e-3;
    const Random random(11, RandomStream::kTest);
    const auto a = random.normal(static_cast<uint32_t>(index), 0);
    const auto b = random.normal(static_cast<uint32_t>(index), 1);
    Vector6d error;
    error << sigma_m * Vector3d(a[0], a[1], a[2]), sigma_rad * Vector3d(b[0], b[1], b[2]);
    ObjectMeasurement m;
    m.source = "told";
    m.object = "thing";
    m.timestamp_ns = index * int64_t{33333000};
    m.T_camera_object = T_world_camera.inverse() * T_world_object * exp(error);
    m.covariance.setZero();
    m.covariance.diagonal() << Vector3d::Constant(sigma_m * sigma_m),
        Vector3d::Constant(sigma_rad * sigma_rad);
    m.health = 1;
    m.claimed = true;
    return m;
  }

  // In units of the direction's length.
  static double distanceToPillar(const Vector3d& origin, const Vector3d& direction) {
    const Vector3d low(-0.35, -0.8, 0.55), high(-0.1, 0.8, 0.8);
    double enter = 0, leave = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      double a = (low[k] - origin[k]) / direction[k], b = (high[k] - origin[k]) / direction[k];
      if (a > b) std::swap(a, b);
      enter = std::max(enter, a);
      leave = std::min(leave, b);
    }
    return enter > 0 && enter < leave ? enter : std::numeric_limits<double>::infinity();
  }

 private:
  static constexpr int kRays = 4;

  static double distanceToWalls(const Vector3d& origin, const Vector3d& direction) {
    const Vector3d half(1, 0.8, 1.2);
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k)
      if (direction[k] != 0) {
        const double t = (std::copysign(half[k], direction[k]) - origin[k]) / direction[k];
        if (t > 0) nearest = std::min(nearest, t);
      }
    return nearest;
  }

  // Blocks of 5 cm, each of a random grey, in [-1, 1].
  static double print(const Vector3d& p) {
    constexpr double kBlock = 0.05;
    uint64_t h = 1469598103934665603ull;
    for (int k = 0; k < 3; ++k) {
      // Half a block off the planes of the walls, so that a wall lies within one layer of blocks.
      const auto cell = static_cast<int64_t>(std::floor(p[k] / kBlock + 0.5));
      h = (h ^ static_cast<uint64_t>(cell + 1000)) * 1099511628211ull;
      h ^= h >> 29;
    }
    return 2 * static_cast<double>((h >> 20) % 1000) / 999 - 1;
  }

  // Made once: undistortion costs more than all the rest.
  const std::vector<Vector3d>& rays() const {
    if (rays_.empty())
      for (int y = 0; y < camera.height(); ++y)
        for (int x = 0; x < camera.width(); ++x)
          for (int k = 0; k < kRays; ++k)
            rays_.push_back(camera.unproject({x + 0.5 * (k % 2) - 0.25, y + 0.5 * (k / 2) - 0.25})
                                .value_or(Vector3d(0, 0, 1)));
    return rays_;
  }
  mutable std::vector<Vector3d> rays_;
};

// The room's pillar where it stands at first, as the shape of an object that has its frame.
class RoomPillar : public RayQuery {
 public:
  void occluded(int, const Vector3d&, std::span<const Vector3d>,
                std::span<uint8_t>) const override {}
  std::optional<RayHit> closestHit(int, const Vector3d& origin,
                                   const Vector3d& direction) const override {
    const SE3 T_world_object = TexturedRoom::poseOfObject();
    const Vector3d from = T_world_object * origin, along = T_world_object.rotation * direction;
    const double t = TexturedRoom::distanceToPillar(from, along);
    if (!std::isfinite(t)) return std::nullopt;
    const bool front = std::abs((from + t * along).z() - 0.55) < 1e-9;
    const Vector3d normal = front ? Vector3d(0, 0, -1) : Vector3d(1, 0, 0);
    return RayHit{origin + t * direction, T_world_object.rotation.conjugate() * normal};
  }
};

}  // namespace diorama::test
