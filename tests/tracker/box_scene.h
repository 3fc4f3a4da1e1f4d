// A box with printed faces before a cluttered background, drawn by analytic rays: a small world in
// which the tracker's truth is known.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/object_model.h"
#include "core/ray_query.h"
#include "core/se3.h"

namespace diorama::test {

// The box [low, high] in the object frame.
struct Box {
  Vector3d low{-0.05, -0.05, 0};
  Vector3d high{0.05, 0.05, 0.2};
};

// 24 vertices, four per face as textured meshes have them, 12 triangles.
inline Mesh boxMesh(const Box& box = {}) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int first = static_cast<int>(mesh.positions.size());
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int corner = 0; corner < 4; ++corner) {
        Vector3d p;
        p[axis] = side ? box.high[axis] : box.low[axis];
        p[u] = corner == 1 || corner == 2 ? box.high[u] : box.low[u];
        p[v] = corner >= 2 ? box.high[v] : box.low[v];
        mesh.positions.push_back(p.cast<float>());
      }
      const int b = side ? 1 : 3, d = side ? 3 : 1;
      mesh.triangles.emplace_back(first, first + b, first + 2);
      mesh.triangles.emplace_back(first, first + 2, first + d);
    }
  return mesh;
}

class BoxRays : public RayQuery {
 public:
  explicit BoxRays(const Box& box = {}) : box_(box) {}

  void occluded(int, const Vector3d& origin, std::span<const Vector3d> points,
                std::span<uint8_t> occluded) const override {
    for (size_t i = 0; i < points.size(); ++i) {
      const auto t = enter(origin, points[i] - origin);
      occluded[i] = t && *t < 1 - 1e-3;
    }
  }

  std::optional<RayHit> closestHit(int, const Vector3d& origin,
                                   const Vector3d& direction) const override {
    const auto t = enter(origin, direction);
    if (!t) return std::nullopt;
    RayHit hit{origin + *t * direction, Vector3d::Zero(), -1};
    double nearest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k)
      for (const auto& [plane, sign] : {std::pair(box_.low[k], -1.0), std::pair(box_.high[k], 1.0)})
        if (std::abs(hit.p_object[k] - plane) < nearest) {
          nearest = std::abs(hit.p_object[k] - plane);
          hit.normal = sign * Vector3d::Unit(k);
          hit.triangle = 2 * (2 * k + (sign > 0));  // the first of the side's two
        }
    return hit;
  }

 private:
  std::optional<double> enter(const Vector3d& origin, const Vector3d& direction) const {
    double t0 = 0, t1 = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
      double a = (box_.low[k] - origin[k]) / direction[k];
      double b = (box_.high[k] - origin[k]) / direction[k];
      if (a > b) std::swap(a, b);
      t0 = std::max(t0, a);
      t1 = std::min(t1, b);
    }
    if (!(t0 < t1) || t0 <= 0) return std::nullopt;
    return t0;
  }
  Box box_;
};

// A smooth pattern of the given wavelength (m or px), in [-1, 1], different for each seed.
inline double pattern(double x, double y, double wavelength, int seed) {
  const double a = 2 * std::numbers::pi / wavelength;
  return (std::sin(a * x + seed) * std::cos(1.3 * a * y + 2 * seed) +
          std::sin(0.7 * a * (x + y) + 3 * seed) * std::cos(0.9 * a * (x - y))) /
         2;
}

struct BoxScene {
  Box box;
  Camera camera{CameraParameters{
      CameraModel::kRadTan, 320, 240, 300, 300, 161, 118, {-0.2, 0.05, 0.001, -0.001}}};
  double print = 40;    // grey levels: contrast of the pattern on the faces
  double clutter = 30;  // ... and of the background
  BoxRays rays{box};

  ObjectModel object() const { return {"box", boxMesh(box), {}}; }

  // Of the object at the place that the ray hits, or of the background behind the pixel.
  double grey(const Vector3d& origin, const Vector3d& direction, const Vector2d& u_px) const {
    const auto hit = rays.closestHit(0, origin, direction);
    if (!hit) {
      const double p = pattern(u_px.x(), u_px.y(), 83, 5);
      return 90 + clutter * (p > 0.1 ? 1 : p < -0.3 ? -1 : 0);
    }
    const int axis = hit->normal.cwiseAbs().maxCoeff() > 0.9 ? majorAxis(hit->normal) : 0;
    return printAt(hit->p_object, axis, hit->normal[axis] > 0);
  }

  // On the box's side that faces along an axis, or against it.
  double printAt(const Vector3d& p_object, int axis, int side) const {
    const double p = pattern(p_object[(axis + 1) % 3], p_object[(axis + 2) % 3], 0.06, axis);
    return 150 + 25 * axis - 30 * side + print * (p > 0.2 ? 1 : p < -0.2 ? -1 : 0);
  }

  // 3 x 3 rays per pixel; the object is not drawn when `absent`.
  Frame draw(const SE3& T_camera_object, int index, bool absent = false) const {
    const SE3 T =
        absent ? SE3{Eigen::Quaterniond::Identity(), Vector3d(0, 0, -10)} : T_camera_object;
    Frame frame;
    frame.index = index;
    frame.timestamp_ns = index * int64_t{33333000};
    frame.gray = Image<uint8_t>(camera.width(), camera.height());
    const std::vector<Vector3d>& directions = subPixelRays();
    const Vector3d origin = T.inverse().translation;
    const Matrix3d R_object_camera = T.rotationMatrix().transpose();
    size_t ray = 0;
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        double light = 0;  // pixels mix light, of which grey values are the root
        for (int k = 0; k < kRays; ++k, ++ray)
          light += std::pow(grey(origin, R_object_camera * directions[ray], subPixel(x, y, k)), 2);
        frame.gray(x, y) =
            static_cast<uint8_t>(std::clamp(std::sqrt(light / kRays) + 0.5, 0.0, 255.0));
      }
    return frame;
  }

 private:
  static constexpr int kRays = 9;
  static Vector2d subPixel(int x, int y, int k) {
    return {x + (k % 3 - 1) / 3.0, y + (k / 3 - 1) / 3.0};
  }

  // Made once: undistortion costs more than all the rest.
  const std::vector<Vector3d>& subPixelRays() const {
    if (sub_pixel_rays_.empty())
      for (int y = 0; y < camera.height(); ++y)
        for (int x = 0; x < camera.width(); ++x)
          for (int k = 0; k < kRays; ++k)
            sub_pixel_rays_.push_back(
                camera.unproject(subPixel(x, y, k)).value_or(Vector3d(0, 0, 1)));
    return sub_pixel_rays_;
  }
  mutable std::vector<Vector3d> sub_pixel_rays_;

  static int majorAxis(const Vector3d& n) {
    int axis = 0;
    n.cwiseAbs().maxCoeff(&axis);
    return axis;
  }
};

// A pose in which three faces show, moving with t.
inline SE3 boxPose(double t = 0) {
  const Vector3d phi(0.3 * std::sin(t), 0.4 * t, 0.2 * std::cos(t));
  const Eigen::Quaterniond upright = expSO3(Vector3d(2.2, 0, 0));
  return {(upright * expSO3(Vector3d(0, 0, 0.7)) * expSO3(phi)).normalized(),
          Vector3d(0.03 * std::sin(t), 0.06, 0.45 + 0.05 * std::sin(2 * t))};
}

}  // namespace diorama::test
