// What eight rays see where they hit: material, baked light, highlight. Shared by the renderer and
// the light baker, and inlined into both.
#pragma once

#include <Eigen/Geometry>

#include "sim/bvh.h"
#include "sim/render_scene.h"
#include "sim/simd.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

// Shading data of the triangles that eight rays hit, spread to lanes.
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
};

constexpr int kTriangleFloats = 22;  // normal0 ... log2_density, one after the other
static_assert(offsetof(ShadingTriangle, light_offset) == kTriangleFloats * sizeof(float));
static_assert(offsetof(TriangleLanes, tint) == kTriangleFloats * sizeof(simd::Float8));

struct Surface {
  simd::Vector8 albedo;
  simd::Vector8 light;     // irradiance / pi
  simd::Vector8 emission;  // radiance
  simd::Vector8 normal;    // unit, shading, towards the viewer
  simd::Float8 specular, lobe;
  simd::Int8 instance;
};

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
  unsigned todo = static_cast<unsigned>(simd::bits(hits.mask));
  const int first = todo ? hits.triangle[__builtin_ctz(todo)] : 0;
  spread(scene, first, out);  // lanes without a hit get something harmless
  todo &= ~static_cast<unsigned>(simd::bits(hits.triangle == splat(first)));
  while (todo) {
    const int triangle = hits.triangle[__builtin_ctz(todo)];
    const Int8 lanes = hits.triangle == splat(triangle);
    spread(scene, triangle, lanes, out);
    todo &= ~static_cast<unsigned>(simd::bits(lanes));
  }
}

// One bilinear tap of a mip level, in linear light: interpolating the coded values would shift
// edges.
inline Vector8 bilinear(const RenderScene& scene, const TriangleLanes& t, Int8 level, Float8 u,
                        Float8 v) {
  const Int8 lw = t.log_width - level, lh = t.log_height - level;
  const Int8 w = splat(1) << lw, h = splat(1) << lh;
  const Float8 x = u * toFloat(w) - 0.5f, y = v * toFloat(h) - 0.5f;
  const Float8 x0 = simd::floor(x), y0 = simd::floor(y);
  const Int8 ix = simd::toInt(x0) & (w - 1), iy = simd::toInt(y0) & (h - 1);
  const Int8 jx = (ix + 1) & (w - 1), jy = (iy + 1) & (h - 1);
  const Float8 fx = x - x0, fy = y - y0;
  // Texels of the levels before this one: 2^area + 2^(area - 2) + ... down to above this level's.
  const Int8 area = t.log_width + t.log_height, same_parity = splat(0x55555555) << (area & 1);
  const Int8 offset =
      t.texture_base + (((splat(2) << area) - (splat(2) << (lw + lh))) & same_parity);
  const Int8 row0 = offset + (iy << lw), row1 = offset + (jy << lw);
  const int* texels = reinterpret_cast<const int*>(scene.textures.texels().data());
  Vector8 sum = simd::splat3(0, 0, 0);
  const auto add = [&](Int8 at, Float8 weight) {
    const Int8 texel = simd::gather(texels, at);
    const Float8 red = toFloat(texel & 0xff), green = toFloat((texel >> 8) & 0xff),
                 blue = toFloat(texel >> 16);
    sum.x += weight * red * red;
    sum.y += weight * green * green;
    sum.z += weight * blue * blue;
  };
  const Float8 w11 = fx * fy, w10 = fx - w11, w01 = fy - w11, w00 = 1.f - fx - w01;
  add(row0 + ix, w00);
  add(row0 + jx, w10);
  add(row1 + ix, w01);
  add(row1 + jx, w11);
  return sum * splat(1.f / (255.f * 255.f));
}

// Interpolates the light map in the grid cell's triangle around (u, v).
inline Vector8 bakedLight(const LightMap& map, Int8 offset, Int8 resolution, Float8 u, Float8 v) {
  const Float8 r = toFloat(resolution);
  const Float8 x = simd::max(u, splat(0.f)) * r, y = simd::max(v, splat(0.f)) * r;
  const Int8 i = simd::min(simd::toInt(x), resolution - 1);
  const Int8 j = simd::max(splat(0), simd::min(simd::toInt(y), resolution - 1 - i));
  const Float8 fx = simd::clamp(x - toFloat(i), 0, 1), fy = simd::clamp(y - toFloat(j), 0, 1);
  const Int8 upper = (fx + fy > 1.f) & (i + j + 2 <= resolution);
  const Float8 s = simd::min(fx + fy, splat(1.f));
  // Lower: corners (i, j) (i+1, j) (i, j+1); upper: (i+1, j+1) (i+1, j) (i, j+1).
  const Float8 w0 = simd::select(upper, fx + fy - 1.f, 1.f - s);
  const Float8 w1 = simd::select(upper, 1.f - fy, fx), w2 = 1.f - w0 - w1;
  const Int8 row = offset + j * (resolution + 1) - ((j * (j - 1)) >> 1);
  const Int8 above = row + resolution + 1 - j;
  const int* samples = reinterpret_cast<const int*>(map.samples.data());
  Vector8 light = simd::splat3(0, 0, 0);
  const auto add = [&](Int8 at, Float8 weight) {
    const Int8 q = simd::gather(samples, at);
    const Float8 red = toFloat(q & 2047), green = toFloat((q >> 11) & 2047),
                 blue = toFloat((q >> 22) & 1023);
    light.x += weight * red * red;
    light.y += weight * green * green;
    light.z += weight * blue * blue;
  };
  add(simd::select(upper, above + i + 1, row + i), w0);
  add(row + i + 1, w1);
  add(above + i, w2);
  const float scale = map.max / (2047.f * 2047.f), blue_scale = map.max / (1023.f * 1023.f);
  return light * Vector8{splat(scale), splat(scale), splat(blue_scale)};
}

inline Vector8 filteredTexture(const RenderScene& scene, const TriangleLanes& t, Float8 u, Float8 v,
                               Float8 lod) {
  const Int8 last = simd::min(t.log_width, t.log_height);
  const Int8 level = simd::max(splat(0), simd::min(simd::toInt(lod), last));
  return bilinear(scene, t, level, u, v);
}

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
  PacketHits plane(const RayPacket& rays, Int8 active) const {
    const Vector8 n = simd::splat3(n_), p0 = simd::splat3(p0_);
    PacketHits hits;
    hits.t = dot(n, p0 - rays.origin) / dot(n, rays.direction);
    const Vector8 d = rays.origin + rays.direction * hits.t - p0;
    hits.u = dot(d, simd::splat3(u_));
    hits.v = dot(d, simd::splat3(v_));
    hits.normal = n;
    hits.triangle = splat(triangle_);
    hits.mask = active & (hits.t > 0.f);
    return hits;
  }

  // Takes the triangle's hits into `nearest` where they are nearer.
  void merge(const RayPacket& rays, Int8 active, PacketHits& nearest) const {
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

// `pixel` is the footprint's width per metre of t across the ray; `dither` in [0, 1) picks between
// two mip levels, so that samples of one pixel together are trilinear. kTaps taps are spread along
// the longer axis of the footprint. `t` is the data of the triangles that were hit.
template <int kTaps>
inline Surface surfaceAt(const RenderScene& scene, const LightView& light, const TriangleLanes& t,
                         const RayPacket& rays, const PacketHits& hits, Float8 pixel,
                         float dither) {
  Surface surface;
  surface.instance = t.instance;
  surface.specular = t.specular;
  surface.lobe = t.lobe;
  const Float8 u = simd::clamp(hits.u, 0, 1), v = simd::clamp(hits.v, 0, 1);
  const Float8 distance = simd::select(hits.mask, hits.t, splat(1.f));

  const Vector8 d = rays.direction * simd::inverseSqrt(dot(rays.direction, rays.direction));
  const Vector8 g =
      hits.normal * simd::inverseSqrt(simd::max(dot(hits.normal, hits.normal), splat(1e-30f)));
  const Float8 cosine = dot(g, d), slant = simd::max(simd::abs(cosine), splat(0.06f));
  const Float8 width = distance * pixel;
  const Float8 minor = simd::log2Approximately(simd::max(width, splat(1e-9f))) + t.log2_density;
  const Float8 major = minor - simd::log2Approximately(slant);
  const Float8 tu = t.uv0[0] + u * t.uv1[0] + v * t.uv2[0];
  const Float8 tv = t.uv0[1] + u * t.uv1[1] + v * t.uv2[1];
  if constexpr (kTaps == 1) {
    const Vector8 texture = filteredTexture(scene, t, tu, tv, (minor + major) * 0.5f + dither);
    surface.albedo = texture;
  } else {
    const Float8 lod = simd::max(minor, major - (kTaps == 2 ? 1.f : 2.f));
    const Float8 k =
        width / slant * simd::inverseSqrt(simd::max(1.f - cosine * cosine, splat(1e-6f)));
    const Vector8 axis = (d - g * cosine) * k;
    const Float8 du =
        t.gradient_u[0] * axis.x + t.gradient_u[1] * axis.y + t.gradient_u[2] * axis.z;
    const Float8 dv =
        t.gradient_v[0] * axis.x + t.gradient_v[1] * axis.y + t.gradient_v[2] * axis.z;
    Vector8 texture = simd::splat3(0, 0, 0);
    for (int q = 0; q < kTaps; ++q) {
      const float along = (static_cast<float>(q) + 0.5f) / kTaps - 0.5f;
      float shift = dither + static_cast<float>((2 * q + (q >> 1)) % kTaps) / kTaps;
      shift -= static_cast<float>(static_cast<int>(shift));
      texture = texture + filteredTexture(scene, t, tu + du * along, tv + dv * along, lod + shift);
    }
    surface.albedo = texture * splat(1.f / kTaps);
  }
  surface.emission = t.emits ? surface.albedo * t.emission : simd::splat3(0, 0, 0);
  surface.albedo = surface.albedo * t.tint;
  surface.light = bakedLight(light.map, t.light_offset, t.light_resolution, u, v);
  Vector8 n = {t.normal0[0] + u * t.normal1[0] + v * t.normal2[0],
               t.normal0[1] + u * t.normal1[1] + v * t.normal2[1],
               t.normal0[2] + u * t.normal1[2] + v * t.normal2[2]};
  const Float8 length = simd::inverseSqrt(simd::max(dot(n, n), splat(1e-12f)));
  surface.normal = n * simd::select(cosine < 0.f, length, -length);
  return surface;
}

template <int kTaps>
inline Surface surfaceAt(const RenderScene& scene, const LightView& light, const RayPacket& rays,
                         const PacketHits& hits, Float8 pixel, float dither) {
  TriangleLanes t;
  loadTriangles(scene, hits, t);
  return surfaceAt<kTaps>(scene, light, t, rays, hits, pixel, dither);
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
    const Float8 inverse_w = 1.f / simd::max(t * s.lobe, splat(1e-4f));
    const Float8 share = coverage(dot(q, axis_u), light.half_u, inverse_w) *
                         coverage(dot(q, axis_v), light.half_v, inverse_w);
    const Int8 sees = (dot(mirror, normal) < -1e-3f) & (t > 0.f);
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
    const Surface s = surfaceAt<1>(scene, light, rays, hits, splat(0.1f), 0.5f);
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
