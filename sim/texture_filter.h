// Textures as eight rays see them: mip levels, taps along the longer side of a pixel's footprint.
#pragma once

#include <array>

#include "sim/triangle_lanes.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

// Where a packet's rays hit, as shading looks at it. Lanes without a hit hold something harmless.
struct ViewedPoint {
  simd::Vector8 direction;     // of the ray, unit
  simd::Float8 cosine, slant;  // between it and the normal; its absolute value, not too small
  simd::Float8 distance;       // t
  simd::Float8 u, v;           // barycentric
};

namespace shading {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::toFloat;
using simd::Vector8;

// The four texels of a mip level around a point, as places in the atlas.
struct TexelSquare {
  Int8 upper, lower;  // rows: of column 0
  Int8 left, right;   // columns
  Float8 fx, fy;      // the point's distance from the upper left one, texels
};

inline TexelSquare texelsAround(const TriangleLanes& t, Int8 level, Float8 u, Float8 v) {
  const Int8 lw = t.log_width - level, lh = t.log_height - level;
  const Int8 w = splat(1) << lw, h = splat(1) << lh;
  const Float8 x = u * toFloat(w) - 0.5f, y = v * toFloat(h) - 0.5f;
  const Float8 x0 = simd::floor(x), y0 = simd::floor(y);
  const Int8 ix = simd::toInt(x0) & (w - 1), iy = simd::toInt(y0) & (h - 1);
  const Int8 jx = (ix + 1) & (w - 1), jy = (iy + 1) & (h - 1);
  // Texels of the levels before this one: 2^area + 2^(area - 2) + ... down to above this level's.
  const Int8 area = t.log_width + t.log_height, same_parity = splat(0x55555555) << (area & 1);
  const Int8 offset =
      t.texture_base + (((splat(2) << area) - (splat(2) << (lw + lh))) & same_parity);
  return {offset + (iy << lw), offset + (jy << lw), ix, jx, x - x0, y - y0};
}

inline Int8 mipLevel(const TriangleLanes& t, Float8 lod) {
  const Int8 last = simd::min(t.log_width, t.log_height);
  return simd::max(splat(0), simd::min(simd::toInt(lod), last));
}

inline const int* texelsOf(const RenderScene& scene) {
  return reinterpret_cast<const int*>(scene.textures.texels().data());
}

// Texels of a square's columns in one of its rows. Neighbours in a row follow one another, but for
// the last and the first of a texture.
inline void texelsOfRow(const int* texels, const TexelSquare& s, Int8 row, Int8& left,
                        Int8& right) {
  if (simd::bits(s.right <= s.left) == 0)
    return simd::gatherPairs(texels, row + s.left, left, right);
  left = simd::gather(texels, row + s.left);
  right = simd::gather(texels, row + s.right);
}

// One bilinear tap, in linear light: interpolating the coded values would shift edges.
inline Vector8 filteredTexture(const RenderScene& scene, const TexelSquare& s) {
  const int* texels = texelsOf(scene);
  Vector8 sum = simd::splat3(0, 0, 0);
  const auto add = [&](Int8 texel, Float8 weight) {
    const Float8 red = toFloat(texel & 0xff), green = toFloat((texel >> 8) & 0xff),
                 blue = toFloat(texel >> 16);
    sum.x += weight * red * red;
    sum.y += weight * green * green;
    sum.z += weight * blue * blue;
  };
  const Float8 w11 = s.fx * s.fy, w10 = s.fx - w11, w01 = s.fy - w11, w00 = 1.f - s.fx - w01;
  Int8 left, right;
  texelsOfRow(texels, s, s.upper, left, right);
  add(left, w00);
  add(right, w10);
  texelsOfRow(texels, s, s.lower, left, right);
  add(left, w01);
  add(right, w11);
  return sum * splat(1.f / (255.f * 255.f));
}

inline Vector8 filteredTexture(const RenderScene& scene, const TriangleLanes& t, Float8 u, Float8 v,
                               Float8 lod) {
  return filteredTexture(scene, texelsAround(t, mipLevel(t, lod), u, v));
}

// What the others of a packet read lies between what these lanes read, in the same cache lines.
constexpr std::array<int, 4> kPacketCorners = {0, 3, 4, 7};

// Whether no lane has a texture of more than one texel.
inline bool isPlain(const TriangleLanes& t) {
  return simd::bits((t.log_width | t.log_height) != splat(0)) == 0;
}

// Asks the memory for what taps there will read, between two mip levels: an atlas is far larger
// than the caches.
inline void prefetchTexture(const RenderScene& scene, const TriangleLanes& t, Float8 u, Float8 v,
                            Float8 lod) {
  const int* texels = texelsOf(scene);
  for (const float part : {0.25f, 0.75f}) {
    const TexelSquare s = texelsAround(t, mipLevel(t, lod + part), u, v);
    const Int8 at = s.upper + s.left;
    for (const int lane : kPacketCorners) __builtin_prefetch(texels + at[lane]);
  }
}

inline ViewedPoint viewedPoint(const TriangleLanes& t, const RayPacket& rays,
                               const PacketHits& hits) {
  ViewedPoint point;
  point.u = simd::clamp(hits.u, 0, 1);
  point.v = simd::clamp(hits.v, 0, 1);
  point.distance = simd::select(hits.mask, hits.t, splat(1.f));
  point.direction = rays.direction * simd::inverseSqrt(dot(rays.direction, rays.direction));
  point.cosine = dot(t.plane, point.direction);
  point.slant = simd::max(simd::abs(point.cosine), splat(0.06f));
  return point;
}

// The mip level at which a texel is as wide as the shorter side of a footprint that is `pixel` wide
// per metre of t, across the ray.
inline Float8 sharpLevel(const TriangleLanes& t, const ViewedPoint& point, Float8 pixel) {
  const Float8 width = point.distance * pixel;
  return simd::log2Approximately(simd::max(width, splat(1e-9f))) + t.log2_density;
}

// The level between those of the footprint's sides: for one of several taps in a pixel.
inline Float8 middleLevel(const TriangleLanes& t, const ViewedPoint& point, Float8 pixel) {
  return sharpLevel(t, point, pixel) - 0.5f * simd::log2Approximately(point.slant);
}

// The level for two taps along the footprint's longer side, which stand for a whole pixel.
inline Float8 levelOfTwo(const TriangleLanes& t, const ViewedPoint& point, Float8 pixel) {
  const Float8 minor = sharpLevel(t, point, pixel);
  return simd::max(minor, minor - simd::log2Approximately(point.slant) - 1.f);
}

inline Vector8 twoTaps(const RenderScene& scene, const TriangleLanes& t, const ViewedPoint& point,
                       Float8 pixel, Float8 level) {
  if (isPlain(t)) return filteredTexture(scene, t, t.tex_u, t.tex_v, level);
  const Float8 sine2 = simd::max(1.f - point.cosine * point.cosine, splat(1e-6f));
  const Float8 quarter = 0.25f * point.distance * pixel / point.slant * simd::inverseSqrt(sine2);
  const Vector8 axis = (point.direction - t.plane * point.cosine) * quarter;
  const Float8 du = t.alongU(axis), dv = t.alongV(axis);
  // Between two mip levels one tap takes the finer one and the other the coarser one.
  return (filteredTexture(scene, t, t.tex_u - du, t.tex_v - dv, level + 0.25f) +
          filteredTexture(scene, t, t.tex_u + du, t.tex_v + dv, level + 0.75f)) *
         splat(0.5f);
}

}  // namespace shading
}  // namespace diorama

#pragma GCC diagnostic pop
