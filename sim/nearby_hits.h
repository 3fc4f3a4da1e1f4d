// The nearest hits of rays that stay within some pixels of a frame.
#pragma once

#include <array>
#include <limits>

#include "sim/candidate_triangles.h"
#include "sim/render_scene.h"
#include "sim/truth_buffer.h"

namespace diorama {

// One triangle against eight rays: cheaper than traversal where it is known what can be hit.
class SingleTriangle {
 public:
  SingleTriangle() = default;
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

  // Takes the triangle's hits into `nearest` where they are nearer.
  void merge(const RayPacket& rays, simd::Int8 active, PacketHits& nearest) const {
    constexpr float kSlack = 1e-4f;  // no gap between neighbours
    PacketHits hits = plane(rays, active);
    hits.mask &= (hits.u >= -kSlack) & (hits.v >= -kSlack) & (hits.u + hits.v <= 1 + kSlack) &
                 (hits.t < nearest.t);
    nearest.t = simd::select(hits.mask, hits.t, nearest.t);
    nearest.u = simd::select(hits.mask, hits.u, nearest.u);
    nearest.v = simd::select(hits.mask, hits.v, nearest.v);
    nearest.normal = simd::select(hits.mask, hits.normal, nearest.normal);
    nearest.triangle = simd::select(hits.mask, hits.triangle, nearest.triangle);
    nearest.mask |= hits.mask;
  }

 private:
  int triangle_ = 0;
  Vector3f p0_, n_, u_, v_;  // u = u_ . (p - p0), v alike
};

// Where the pixels show but a few triangles that form one surface, these are tried first; a packet
// with a ray that misses them all is traced. Where an outline passes, all are traced: the last
// triangles before the outline of something smooth are seen edge-on, too narrow to show at a
// pixel's centre, and what stands behind them would be taken for them.
class NearbyHits {
 public:
  NearbyHits(const RenderScene& scene, const VisibleTriangles& around) : scene_(scene) {
    constexpr int kMost = CandidateTriangles::kMost;
    if (around.nothing || around.count == 0 || around.count > kMost) return;
    CandidateTriangles candidates;
    for (int k = 0; k < around.count; ++k)
      candidates.add(static_cast<uint32_t>(around.triangle[static_cast<size_t>(k)]) + 1);
    if (!candidates.formOneSurface(scene)) return;
    for (const uint32_t triangle : candidates)
      triangles_[count_++] = SingleTriangle(scene, triangle);
  }

  PacketHits operator()(const RayPacket& rays, simd::Int8 active) const {
    if (count_ > 0) {
      PacketHits hits;
      hits.t = simd::splat(std::numeric_limits<float>::infinity());
      hits.u = hits.v = simd::splat(0.f);
      hits.normal = simd::splat3(0, 0, 1);
      hits.triangle = hits.mask = simd::splat(0);
      for (size_t k = 0; k < count_; ++k) triangles_[k].merge(rays, active, hits);
      if (simd::bits(active & ~hits.mask) == 0) return hits;
    }
    return scene_.quick_bvh->closest(rays, active, simd::splat(0.f), true);
  }

 private:
  const RenderScene& scene_;
  size_t count_ = 0;
  std::array<SingleTriangle, CandidateTriangles::kMost> triangles_;
};

}  // namespace diorama
