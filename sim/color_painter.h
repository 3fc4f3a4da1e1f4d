// The colours of pixels among what rests: by one sample, by one with the texture along the camera's
// motion, or by many.
#pragma once

#include "sim/ray_table.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"
#include "sim/sample_candidates.h"
#include "sim/sample_pattern.h"
#include "sim/shading.h"

namespace diorama {

// What the rays through a packet's pixel centres meet, looked up but not yet read.
struct Sight {
  RayPacket rays;
  PacketHits hits;
  TriangleLanes triangles;
  ViewedPoint point;
  shading::LightCorners light;
  simd::Float8 level;  // of the texture
};

struct ColorPainter {
  const RenderScene& scene;
  LightView light;
  float brightest = 0;  // ExposureMotion::brightest

  // The first of two steps that drawing a packet takes: between them the memory has time to answer.
  // For sharp() or, with a footprint of a sample in pixels, for smooth(). `hits` are those of
  // `rays`, the rays through the pixel centres.
  void look(const PacketRays& packet, const RayPacket& rays, const PacketHits& hits,
            Sight& sight) const;
  void look(const PacketRays& packet, const RayPacket& rays, const PacketHits& hits,
            float footprint, Sight& sight) const;

  // Pixels of a packet by one sharp sample in the middle of each.
  simd::Vector8 sharp(const PacketRays& packet, const Sight& sight) const;

  // Pixels that show one patch over the whole exposure: light and highlight as in the middle, the
  // texture as each sample of the pattern sees it on the tangent plane.
  simd::Vector8 smooth(const PacketRays& packet, const Sight& sight,
                       const PatternRows& pattern) const;

  // Any pixel: each sample is hit and shaded by itself; all of them where the first half shows
  // contrast.
  Radiance sampled(const PacketRays& packet, size_t lane, const SamplePattern& pattern,
                   const PixelCandidates& candidates) const;

 private:
  bool meet(const RayPacket& rays, const PacketHits& hits, Sight& sight) const;
  void prefetch(const Sight& sight) const;
};

}  // namespace diorama
