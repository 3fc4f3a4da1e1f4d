// What shading needs of the triangles that eight rays hit.
#pragma once

#include "sim/bvh.h"
#include "sim/render_scene.h"
#include "sim/simd.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

// At the places that are hit.
struct TriangleLanes {
  simd::Vector8 plane;   // unit normal of the triangle
  simd::Vector8 normal;  // of the smooth surface, any length
  simd::Float8 tex_u, tex_v;
  simd::Vector8 gradient_u, gradient_v;
  simd::Float8 log2_density;
  simd::Int8 light_offset, light_resolution;
  // Of the material:
  simd::Vector8 tint, emission;
  simd::Float8 specular, lobe;
  simd::Int8 texture_base, log_width, log_height;
  bool emits = false;

  // Change of the texture coordinates along a way on the surface, m.
  simd::Float8 alongU(const simd::Vector8& way) const { return dot(gradient_u, way); }
  simd::Float8 alongV(const simd::Vector8& way) const { return dot(gradient_v, way); }
};

namespace shading {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::toFloat;
using simd::Vector8;

// What one triangle has at (u, v), for all lanes. `put` writes it to those that need it.
template <bool kGradients, class Put>
void loadTriangle(const ShadingTriangle& t, Float8 u, Float8 v, const Put& put,
                  TriangleLanes& out) {
  const auto at = [&](const float* a0, const float* a1, const float* a2) {
    return *a0 + u * *a1 + v * *a2;
  };
  put(out.plane.x, splat(t.plane[0]));
  put(out.plane.y, splat(t.plane[1]));
  put(out.plane.z, splat(t.plane[2]));
  put(out.normal.x, at(t.normal0, t.normal1, t.normal2));
  put(out.normal.y, at(t.normal0 + 1, t.normal1 + 1, t.normal2 + 1));
  put(out.normal.z, at(t.normal0 + 2, t.normal1 + 2, t.normal2 + 2));
  put(out.tex_u, at(t.uv0, t.uv1, t.uv2));
  put(out.tex_v, at(t.uv0 + 1, t.uv1 + 1, t.uv2 + 1));
  if constexpr (kGradients) {
    put(out.gradient_u.x, splat(t.gradient_u[0]));
    put(out.gradient_u.y, splat(t.gradient_u[1]));
    put(out.gradient_u.z, splat(t.gradient_u[2]));
    put(out.gradient_v.x, splat(t.gradient_v[0]));
    put(out.gradient_v.y, splat(t.gradient_v[1]));
    put(out.gradient_v.z, splat(t.gradient_v[2]));
  }
  put(out.log2_density, splat(t.log2_density));
  put(out.light_offset, splat(t.light_offset));
  put(out.light_resolution, splat(t.light_resolution));
}

template <class Put>
void loadMaterial(const ShadingMaterial& m, const Put& put, TriangleLanes& out) {
  put(out.tint.x, splat(m.tint[0]));
  put(out.tint.y, splat(m.tint[1]));
  put(out.tint.z, splat(m.tint[2]));
  put(out.emission.x, splat(m.emission[0]));
  put(out.emission.y, splat(m.emission[1]));
  put(out.emission.z, splat(m.emission[2]));
  put(out.specular, splat(m.specular));
  put(out.lobe, splat(m.lobe));
  put(out.texture_base, splat(m.texture.base));
  put(out.log_width, splat(m.texture.log_width));
  put(out.log_height, splat(m.texture.log_height));
  out.emits |= m.emits;
}

// One broadcast of a triangle's data per distinct triangle instead of gathers. Lanes without a hit
// get something harmless.
template <bool kGradients>
void loadTriangles(const RenderScene& scene, const PacketHits& hits, TriangleLanes& out) {
  const Float8 u = simd::clamp(hits.u, 0, 1), v = simd::clamp(hits.v, 0, 1);
  auto pending = static_cast<unsigned>(simd::bits(hits.mask));
  const int first = pending ? hits.triangle[__builtin_ctz(pending)] : 0;
  const ShadingTriangle& t = scene.triangles[static_cast<size_t>(first)];
  const auto all = [](auto& to, const auto& value) { to = value; };
  out.emits = false;
  loadTriangle<kGradients>(t, u, v, all, out);
  loadMaterial(scene.materials[static_cast<size_t>(t.material)], all, out);
  pending &= ~static_cast<unsigned>(simd::bits(hits.triangle == splat(first)));
  while (pending) {
    const int triangle = hits.triangle[__builtin_ctz(pending)];
    const ShadingTriangle& other = scene.triangles[static_cast<size_t>(triangle)];
    const Int8 lanes = hits.triangle == splat(triangle);
    const auto some = [&](auto& to, const auto& value) { to = simd::select(lanes, value, to); };
    loadTriangle<kGradients>(other, u, v, some, out);
    if (other.material != t.material)
      loadMaterial(scene.materials[static_cast<size_t>(other.material)], some, out);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
}

}  // namespace shading
}  // namespace diorama

#pragma GCC diagnostic pop
