// Depth on a triangle's plane in double precision: what single-precision traversal finds is off by
// some 1e-6 of the distance, and more at grazing angles.
#pragma once

#include <Eigen/Geometry>

#include "sim/render_scene.h"
#include "sim/row_cameras.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

class PlaneDepth {
 public:
  explicit PlaneDepth(const RenderScene& scene) : scene_(scene) {}

  // Of a packet whose two rows are seen by `first` and `second`; 0 where nothing is hit.
  simd::Float8 operator()(const CameraFrame& first, const CameraFrame& second,
                          const PacketRays& packet, const PacketHits& hits) {
    simd::Float8 depth = simd::splat(0.f);
    auto pending = static_cast<unsigned>(simd::bits(hits.mask));
    while (pending != 0) {
      const int lane = __builtin_ctz(pending), triangle = hits.triangle[lane];
      simd::Int8 lanes = hits.triangle == simd::splat(triangle);
      if (&first != &second) lanes &= laneY(lane) == 0 ? ~kSecondRow : kSecondRow;
      setTriangle(laneY(lane) == 0 ? first : second, static_cast<uint32_t>(triangle));
      depth = simd::select(lanes, onPlane(packet), depth);
      pending &= ~static_cast<unsigned>(simd::bits(lanes));
    }
    // Seen edge-on the plane says nothing.
    const simd::Int8 agrees = simd::abs(depth - hits.t) <= 1e-3f * hits.t;
    return simd::select(hits.mask, simd::select(agrees, depth, hits.t), simd::splat(0.f));
  }

 private:
  using Double8 = double __attribute__((vector_size(64)));

  void setTriangle(const CameraFrame& camera, uint32_t triangle) {
    if (triangle == triangle_ && &camera == camera_) return;
    triangle_ = triangle;
    camera_ = &camera;
    const Vector3d p0 = scene_.corner(triangle, 0).cast<double>();
    const Vector3d n = (scene_.corner(triangle, 1).cast<double>() - p0)
                           .cross(scene_.corner(triangle, 2).cast<double>() - p0);
    height_ = n.dot(p0 - camera.origin);
    n_camera_ = camera.R.transpose() * n;
  }

  // Along the directions (x, y, 1) of the camera.
  simd::Float8 onPlane(const PacketRays& packet) const {
    const Double8 x = __builtin_convertvector(simd::load(packet.x), Double8);
    const Double8 y = __builtin_convertvector(simd::load(packet.y), Double8);
    return __builtin_convertvector(
        height_ / (n_camera_.x() * x + n_camera_.y() * y + n_camera_.z()), simd::Float8);
  }

  const RenderScene& scene_;
  const CameraFrame* camera_ = nullptr;
  uint32_t triangle_ = UINT32_MAX;
  Vector3d n_camera_ = Vector3d::Zero();
  double height_ = 0;
};

}  // namespace diorama

#pragma GCC diagnostic pop
