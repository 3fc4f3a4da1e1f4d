// Depth on a triangle's plane in double precision: what single-precision traversal finds is off by
// some 1e-6 of the distance, and more at grazing angles.
#pragma once

#include <Eigen/Geometry>

#include "sim/render_scene.h"
#include "sim/row_cameras.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

// A triangle's plane as a camera sees it.
struct CameraPlane {
  Vector3d normal;  // any length
  double height;    // its product with a point of the plane

  // Along the directions (x, y, 1) of the camera.
  simd::Float8 depth(const PacketRays& packet) const {
    using Double8 = double __attribute__((vector_size(64)));
    const Double8 x = __builtin_convertvector(simd::load(packet.x), Double8);
    const Double8 y = __builtin_convertvector(simd::load(packet.y), Double8);
    return __builtin_convertvector(height / (normal.x() * x + normal.y() * y + normal.z()),
                                   simd::Float8);
  }
  // Seen edge-on the plane says nothing: then it is `t` that counts.
  static simd::Float8 chosen(simd::Float8 depth, simd::Float8 t) {
    return simd::select(simd::abs(depth - t) <= 1e-3f * t, depth, t);
  }
};

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
      depth = simd::select(lanes, plane_.depth(packet), depth);
      pending &= ~static_cast<unsigned>(simd::bits(lanes));
    }
    return simd::select(hits.mask, CameraPlane::chosen(depth, hits.t), simd::splat(0.f));
  }

 private:
  void setTriangle(const CameraFrame& camera, uint32_t triangle) {
    if (triangle == triangle_ && &camera == camera_) return;
    triangle_ = triangle;
    camera_ = &camera;
    const Vector3d p0 = scene_.corner(triangle, 0).cast<double>();
    const Vector3d n = (scene_.corner(triangle, 1).cast<double>() - p0)
                           .cross(scene_.corner(triangle, 2).cast<double>() - p0);
    plane_ = {camera.R.transpose() * n, n.dot(p0 - camera.origin)};
  }

  const RenderScene& scene_;
  const CameraFrame* camera_ = nullptr;
  uint32_t triangle_ = UINT32_MAX;
  CameraPlane plane_{};
};

}  // namespace diorama

#pragma GCC diagnostic pop
