#include "sim/color_painter.h"

#include <algorithm>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

float least(Float8 v) {
  float result = v[0];
  for (int k = 1; k < 8; ++k) result = std::min(result, v[k]);
  return result;
}
float greatest(Float8 v) { return -least(-v); }

}  // namespace

bool ColorPainter::meet(const RayPacket& rays, const PacketHits& hits, Sight& sight) const {
  sight.rays = rays;
  sight.hits = hits;
  if (!simd::bits(sight.hits.mask)) return false;
  shading::loadTriangles<true>(scene, sight.hits, sight.triangles);
  sight.point = shading::viewedPoint(sight.triangles, sight.rays, sight.hits);
  sight.light = shading::lightCorners(sight.triangles, sight.point);
  return true;
}

void ColorPainter::prefetch(const Sight& sight) const {
  shading::prefetchLight(light.map, sight.light);
  shading::prefetchTexture(scene, sight.triangles, sight.triangles.tex_u, sight.triangles.tex_v,
                           sight.level);
}

void ColorPainter::look(const PacketRays& packet, const RayPacket& rays, const PacketHits& hits,
                        Sight& sight) const {
  if (!meet(rays, hits, sight)) return;
  sight.level = shading::levelOfTwo(sight.triangles, sight.point, splat(packet.pixel));
  prefetch(sight);
}

void ColorPainter::look(const PacketRays& packet, const RayPacket& rays, const PacketHits& hits,
                        float footprint, Sight& sight) const {
  if (!meet(rays, hits, sight)) return;
  sight.level = shading::middleLevel(sight.triangles, sight.point, splat(packet.pixel * footprint));
  prefetch(sight);
}

Vector8 ColorPainter::sharp(const PacketRays& packet, const Sight& sight) const {
  if (!simd::bits(sight.hits.mask)) return simd::splat3(scene.sky);
  const Vector8 texture =
      shading::twoTaps(scene, sight.triangles, sight.point, splat(packet.pixel), sight.level);
  const Surface surface =
      shading::surfaceOf(light, sight.triangles, sight.point, sight.light, texture);
  return shading::radianceOf(scene, light, sight.rays, sight.hits, surface);
}

Vector8 ColorPainter::smooth(const PacketRays& packet, const Sight& sight,
                             const PatternRows& pattern) const {
  if (!simd::bits(sight.hits.mask)) return simd::splat3(scene.sky);
  const TriangleLanes& t = sight.triangles;
  const ViewedPoint& point = sight.point;
  const Vector8 p = sight.rays.origin + sight.rays.direction * point.distance;
  Vector8 texture = simd::splat3(0, 0, 0);
  const size_t taps = shading::isPlain(t) ? 1 : pattern.first.taps.size();
  for (size_t k = 0; k < taps; ++k) {
    const PixelSample& sample = pattern.first.taps[k];
    const RayPacket ray = raysOf(packet, sample, pattern.second.taps[k]);
    const Vector8 to = p - ray.origin;
    const Vector8 way = ray.direction * (dot(t.plane, to) / dot(t.plane, ray.direction)) - to;
    texture =
        texture + shading::filteredTexture(scene, t, t.tex_u + t.alongU(way),
                                           t.tex_v + t.alongV(way), sight.level + sample.dither);
  }
  texture = texture * splat(1.f / static_cast<float>(taps));
  const Surface surface = shading::surfaceOf(light, t, point, sight.light, texture);
  return simd::min(shading::radianceOf(scene, light, sight.rays, sight.hits, surface),
                   splat(brightest));
}

Radiance ColorPainter::sampled(const PacketRays& packet, size_t lane, const SamplePattern& pattern,
                               const PixelCandidates& candidates) const {
  const Float8 pixel = splat(packet.pixel * pattern.footprint);
  Vector8 sum = simd::splat3(0, 0, 0);
  Float8 darkest = splat(1e30f), lightest = splat(0.f);
  const auto add = [&](const std::vector<SampleLanes>& samples) {
    for (const SampleLanes& sample : samples) {
      const RayPacket rays = raysOf(packet, lane, sample);
      const PacketHits hits = candidates.closest(rays);
      Vector8 color = simd::splat3(scene.sky);
      if (simd::bits(hits.mask))
        color =
            shading::radianceOf(scene, light, rays, hits,
                                shading::surfaceAt(scene, light, rays, hits, pixel, sample.dither));
      color = simd::min(color, splat(brightest));
      sum = sum + color;
      const Float8 brightness = color.x + color.y + color.z;
      darkest = simd::min(darkest, brightness);
      lightest = simd::max(lightest, brightness);
    }
  };
  // Eight samples show a contrast c with an error of about c / 17: below a grey level or so for
  // less contrast than this, as a part of the lightest.
  constexpr float kContrast = 0.25f;
  add(pattern.base_lanes);
  auto count = static_cast<float>(pattern.base.size());
  if (const float most = greatest(lightest); most - least(darkest) > kContrast * most) {
    add(pattern.extra_lanes);
    count += static_cast<float>(pattern.extra.size());
  }
  return {simd::sum(sum.x) / count, simd::sum(sum.y) / count, simd::sum(sum.z) / count};
}

}  // namespace diorama
