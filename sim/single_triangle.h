// One triangle and eight rays: cheaper than traversal where it is known what is hit.
#pragma once

#include "sim/bvh.h"
#include "sim/render_scene.h"

namespace diorama {

class SingleTriangle {
 public:
  SingleTriangle(const RenderScene& scene, uint32_t triangle)
      : triangle_(static_cast<int>(triangle)), p0_(scene.corner(triangle, 0)) {
    const Vector3f e1 = scene.corner(triangle, 1) - p0_, e2 = scene.corner(triangle, 2) - p0_;
    n_ = e1.cross(e2);
    u_ = e2.cross(n_) / n_.squaredNorm();
    v_ = n_.cross(e1) / n_.squaredNorm();
  }

  // The plane's hits; they may lie outside the triangle.
  PacketHits plane(const RayPacket& rays, simd::Int8 active) const {
    const simd::Vector8 n = simd::splat3(n_), p0 = simd::splat3(p0_);
    PacketHits hits;
    hits.t = dot(n, p0 - rays.origin) / dot(n, rays.direction);
    const simd::Vector8 d = rays.origin + rays.direction * hits.t - p0;
    hits.u = dot(d, simd::splat3(u_));
    hits.v = dot(d, simd::splat3(v_));
    hits.normal = n;
    hits.triangle = simd::splat(triangle_);
    hits.mask = active & (hits.t > 0.f);
    return hits;
  }

 private:
  int triangle_ = 0;
  Vector3f p0_, n_, u_, v_;  // u = u_ . (p - p0), v alike
};

}  // namespace diorama
