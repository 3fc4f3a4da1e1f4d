// What shading needs of the triangles that eight rays hit.
#pragma once

#include <cstddef>

#include "sim/bvh.h"
#include "sim/render_scene.h"
#include "sim/simd.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

// Spread to lanes.
struct TriangleLanes {
  simd::Float8 normal0[3], normal1[3], normal2[3];
  simd::Float8 uv0[2], uv1[2], uv2[2];
  simd::Float8 gradient_u[3], gradient_v[3];
  simd::Float8 log2_density;
  simd::Vector8 tint, emission;
  simd::Float8 specular, lobe;
  simd::Int8 light_offset, light_resolution;
  simd::Int8 texture_base, log_width, log_height, instance;
  bool emits = false;

  // Change of the texture coordinates along a way on the surface, m.
  simd::Float8 alongU(const simd::Vector8& way) const { return along(gradient_u, way); }
  simd::Float8 alongV(const simd::Vector8& way) const { return along(gradient_v, way); }

 private:
  static simd::Float8 along(const simd::Float8* gradient, const simd::Vector8& way) {
    return gradient[0] * way.x + gradient[1] * way.y + gradient[2] * way.z;
  }
};

constexpr int kTriangleFloats = 22;  // normal0 ... log2_density, one after the other
static_assert(offsetof(ShadingTriangle, light_offset) == kTriangleFloats * sizeof(float));
static_assert(offsetof(TriangleLanes, tint) == kTriangleFloats * sizeof(simd::Float8));

namespace shading {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::toFloat;
using simd::Vector8;

// Gives the triangle's data to all lanes.
inline void spread(const RenderScene& scene, int triangle, TriangleLanes& out) {
  const ShadingTriangle& t = scene.triangles[static_cast<size_t>(triangle)];
  const ShadingMaterial& m = scene.materials[static_cast<size_t>(t.material)];
  const float* from = t.normal0;
  Float8* to = out.normal0;
  for (int k = 0; k < kTriangleFloats; ++k) to[k] = splat(from[k]);
  out.tint = simd::splat3(m.tint);
  out.emission = simd::splat3(m.emission);
  out.specular = splat(m.specular);
  out.lobe = splat(m.lobe);
  out.light_offset = splat(t.light_offset);
  out.light_resolution = splat(t.light_resolution);
  out.texture_base = splat(m.texture.base);
  out.log_width = splat(m.texture.log_width);
  out.log_height = splat(m.texture.log_height);
  out.instance = splat(t.instance);
  out.emits = m.emits;
}

inline void spread(const RenderScene& scene, int triangle, Int8 lanes, TriangleLanes& out) {
  const ShadingTriangle& t = scene.triangles[static_cast<size_t>(triangle)];
  const ShadingMaterial& m = scene.materials[static_cast<size_t>(t.material)];
  const float* from = t.normal0;
  Float8* to = out.normal0;
  for (int k = 0; k < kTriangleFloats; ++k) to[k] = simd::select(lanes, splat(from[k]), to[k]);
  out.tint = simd::select(lanes, simd::splat3(m.tint), out.tint);
  out.emission = simd::select(lanes, simd::splat3(m.emission), out.emission);
  out.specular = simd::select(lanes, splat(m.specular), out.specular);
  out.lobe = simd::select(lanes, splat(m.lobe), out.lobe);
  out.light_offset = simd::select(lanes, splat(t.light_offset), out.light_offset);
  out.light_resolution = simd::select(lanes, splat(t.light_resolution), out.light_resolution);
  out.texture_base = simd::select(lanes, splat(m.texture.base), out.texture_base);
  out.log_width = simd::select(lanes, splat(m.texture.log_width), out.log_width);
  out.log_height = simd::select(lanes, splat(m.texture.log_height), out.log_height);
  out.instance = simd::select(lanes, splat(t.instance), out.instance);
  out.emits |= m.emits;
}

// One broadcast of a triangle's data per distinct triangle instead of gathers.
inline void loadTriangles(const RenderScene& scene, const PacketHits& hits, TriangleLanes& out) {
  unsigned pending = static_cast<unsigned>(simd::bits(hits.mask));
  const int first = pending ? hits.triangle[__builtin_ctz(pending)] : 0;
  spread(scene, first, out);  // lanes without a hit get something harmless
  pending &= ~static_cast<unsigned>(simd::bits(hits.triangle == splat(first)));
  while (pending) {
    const int triangle = hits.triangle[__builtin_ctz(pending)];
    const Int8 lanes = hits.triangle == splat(triangle);
    spread(scene, triangle, lanes, out);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
}

}  // namespace shading
}  // namespace diorama

#pragma GCC diagnostic pop
