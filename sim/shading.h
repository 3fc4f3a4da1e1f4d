// What eight rays see where they hit: material, baked light, highlight. Shared by the renderer and
// the light baker, and inlined into both.
#pragma once

#include <Eigen/Geometry>

#include "sim/texture_filter.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

struct Surface {
  simd::Vector8 albedo;
  simd::Vector8 light;     // irradiance / pi
  simd::Vector8 emission;  // radiance
  simd::Vector8 normal;    // unit, shading, towards the viewer
  simd::Float8 specular, lobe;
};

namespace shading {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::toFloat;
using simd::Vector8;

// The samples of a light map at the corners of the grid cell's triangle around (u, v): two that
// follow one another, and the one above or below them.
struct LightCorners {
  Int8 pair, single;
  Float8 weight[3];  // of the pair's first and second, and of the single one
};

inline LightCorners lightCorners(Int8 offset, Int8 resolution, Float8 u, Float8 v) {
  const Float8 r = toFloat(resolution);
  const Float8 x = simd::max(u, splat(0.f)) * r, y = simd::max(v, splat(0.f)) * r;
  const Int8 i = simd::min(simd::toInt(x), resolution - 1);
  const Int8 j = simd::max(splat(0), simd::min(simd::toInt(y), resolution - 1 - i));
  const Float8 fx = simd::clamp(x - toFloat(i), 0, 1), fy = simd::clamp(y - toFloat(j), 0, 1);
  const Int8 upper = (fx + fy > 1.f) & (i + j + 2 <= resolution);
  const Float8 s = simd::min(fx + fy, splat(1.f));
  // Lower: corners (i, j) (i+1, j) (i, j+1); upper: (i, j+1) (i+1, j+1) (i+1, j).
  const Float8 corner = simd::select(upper, fx + fy - 1.f, 1.f - s);  // at the right angle
  const Float8 right = simd::select(upper, 1.f - fy, fx), above = 1.f - corner - right;
  const Int8 row = offset + j * (resolution + 1) - ((j * (j - 1)) >> 1) + i;
  const Int8 next = row + resolution + 1 - j;
  return {simd::select(upper, next, row),
          simd::select(upper, row + 1, next),
          {simd::select(upper, above, corner), simd::select(upper, corner, right),
           simd::select(upper, right, above)}};
}

inline Vector8 bakedLight(const LightMap& map, const LightCorners& corners) {
  const int* samples = reinterpret_cast<const int*>(map.samples.data());
  Int8 at[3];
  simd::gatherPairs(samples, corners.pair, at[0], at[1]);
  at[2] = simd::gather(samples, corners.single);
  Vector8 light = simd::splat3(0, 0, 0);
  for (int k = 0; k < 3; ++k) {
    const Int8 q = at[k];
    const Float8 red = toFloat(q & 2047), green = toFloat((q >> 11) & 2047),
                 blue = toFloat((q >> 22) & 1023);
    light.x += corners.weight[k] * red * red;
    light.y += corners.weight[k] * green * green;
    light.z += corners.weight[k] * blue * blue;
  }
  const float scale = map.max / (2047.f * 2047.f), blue_scale = map.max / (1023.f * 1023.f);
  return light * Vector8{splat(scale), splat(scale), splat(blue_scale)};
}

inline LightCorners lightCorners(const TriangleLanes& t, const ViewedPoint& point) {
  return lightCorners(t.light_offset, t.light_resolution, point.u, point.v);
}

inline void prefetchLight(const LightMap& map, const LightCorners& corners) {
  for (const Int8& at : {corners.pair, corners.single})  // in two rows
    for (const int lane : kPacketCorners)
      __builtin_prefetch(&map.samples[static_cast<size_t>(at[lane])]);
}

// `texture` is what the material's texture shows there.
inline Surface surfaceOf(const LightView& light, const TriangleLanes& t, const ViewedPoint& point,
                         const LightCorners& corners, const Vector8& texture) {
  Surface surface;
  surface.specular = t.specular;
  surface.lobe = t.lobe;
  surface.emission = t.emits ? texture * t.emission : simd::splat3(0, 0, 0);
  surface.albedo = texture * t.tint;
  surface.light = bakedLight(light.map, corners);
  const Vector8& n = t.normal;
  const Float8 length = simd::inverseSqrt(simd::max(dot(n, n), splat(1e-12f)));
  surface.normal = n * simd::select(point.cosine < 0.f, length, -length);
  return surface;
}

// One of several samples of a pixel: `pixel` is its footprint's width per metre of t, `dither` in
// [0, 1) picks between two mip levels, so that the samples of a pixel together are trilinear.
inline Surface surfaceAt(const RenderScene& scene, const LightView& light, const RayPacket& rays,
                         const PacketHits& hits, Float8 pixel, Float8 dither) {
  TriangleLanes t;
  loadTriangles<false>(scene, hits, t);
  const ViewedPoint point = viewedPoint(t, rays, hits);
  const Float8 level = middleLevel(t, point, pixel) + dither;
  return surfaceOf(light, t, point, lightCorners(t, point),
                   filteredTexture(scene, t, t.tex_u, t.tex_v, level));
}

// A whole pixel by one sample.
inline Surface surfaceOfPixel(const RenderScene& scene, const LightView& light,
                              const RayPacket& rays, const PacketHits& hits, Float8 pixel) {
  TriangleLanes t;
  loadTriangles<true>(scene, hits, t);
  const ViewedPoint point = viewedPoint(t, rays, hits);
  return surfaceOf(light, t, point, lightCorners(t, point),
                   twoTaps(scene, t, point, pixel, levelOfTwo(t, point, pixel)));
}

// Share of a bell of half width w around a that lies within [-half, half].
inline Float8 coverage(Float8 a, float half, Float8 inverse_w) {
  const auto rise = [](Float8 x) {
    const Float8 s = simd::clamp(x * 0.5f + 0.5f, 0, 1);
    return s * s * (3.f - 2.f * s);
  };
  return rise((half - a) * inverse_w) - rise((-half - a) * inverse_w);
}

// The mirror ray meets each light's plane; a glossy surface sees the light blurred by its lobe.
// What lies in shadow shows no highlight: the baked light says so.
inline Vector8 highlight(const LightView& view, const RayPacket& rays, const PacketHits& hits,
                         const Surface& s) {
  const Vector8 d = rays.direction * simd::inverseSqrt(dot(rays.direction, rays.direction));
  const Float8 cosine = dot(d, s.normal);
  const Vector8 mirror = d - s.normal * (2.f * cosine);
  const Vector8 p = rays.origin + rays.direction * simd::select(hits.mask, hits.t, splat(1.f));
  const Float8 f = 1.f - simd::min(simd::abs(cosine), splat(1.f)), f2 = f * f;
  // Schlick's Fresnel term; a rough surface gains less at grazing angles.
  const Float8 gain = simd::max(0.6f - s.lobe * 0.8f, splat(0.f));
  const Float8 fresnel =
      s.specular + (gain * simd::min(s.specular * 25.f, splat(1.f))) * (f2 * f2 * f);
  Vector8 sum = s.light * splat(0.5f);  // what else the mirror ray may meet
  const Float8 lit = simd::min(s.light.y * (1.5f / view.map.typical), splat(1.f));
  const Float8 gate = lit * lit;
  for (const RectangleLight& light : view.lights) {
    const Vector8 axis_u = simd::splat3(light.axis_u), axis_v = simd::splat3(light.axis_v),
                  normal = simd::splat3(light.normal);
    const Vector8 to = simd::splat3(light.center) - p;
    const Float8 towards = simd::min(dot(mirror, normal), splat(-1e-3f));
    const Float8 t = dot(to, normal) / towards;
    const Vector8 q = mirror * t - to;
    const Float8 u = dot(q, axis_u), v = dot(q, axis_v), w = simd::max(t * s.lobe, splat(1e-4f));
    const Int8 sees = (dot(mirror, normal) < -1e-3f) & (t > 0.f) &
                      (simd::abs(u) < light.half_u + w) & (simd::abs(v) < light.half_v + w);
    if (simd::bits(sees) == 0) continue;
    const Float8 inverse_w = 1.f / w;
    const Float8 share =
        coverage(u, light.half_u, inverse_w) * coverage(v, light.half_v, inverse_w);
    sum = sum + simd::splat3(light.radiance) * simd::select(sees, share * gate, splat(0.f));
  }
  return sum * fresnel;
}

inline Vector8 radianceOf(const RenderScene& scene, const LightView& light, const RayPacket& rays,
                          const PacketHits& hits, const Surface& s) {
  const Vector8 glossy = highlight(light, rays, hits, s);
  const Vector8 seen = s.albedo * s.light + s.emission + glossy;
  return simd::select(hits.mask, seen, simd::splat3(scene.sky));
}

// The diffuse radiance that comes from the rays' directions, without area lights: what lights other
// surfaces. Backs of faces are black; adds the rays that meet one to back_faces.
inline Vector8 diffuseRadiance(const RenderScene& scene, const LightView& light,
                               const RayPacket& rays, PacketHits hits, int& back_faces) {
  const Int8 missed = ~hits.mask;
  const Int8 back = hits.mask & (dot(hits.normal, rays.direction) > 0.f);
  back_faces += __builtin_popcount(static_cast<unsigned>(simd::bits(back)));
  hits.mask &= ~back;
  Vector8 seen = simd::splat3(0, 0, 0);
  if (simd::bits(hits.mask)) {
    const Surface s = surfaceAt(scene, light, rays, hits, splat(0.1f), splat(0.5f));
    Vector8 emission = s.emission;
    for (int i = 0; i < 8; ++i)
      if (hits.mask[i] && scene.is_lamp[static_cast<size_t>(hits.triangle[i])])
        emission.x[i] = emission.y[i] = emission.z[i] = 0;
    seen = simd::select(hits.mask, s.albedo * s.light + emission, seen);
  }
  return simd::select(missed, simd::splat3(scene.sky), seen);
}

}  // namespace shading
}  // namespace diorama

#pragma GCC diagnostic pop
