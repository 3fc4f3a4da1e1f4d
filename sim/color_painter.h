// The colours of pixels among what rests: by one sample, by one with the texture along the camera's
// motion, or by many.
#pragma once

#include "sim/nearby_hits.h"
#include "sim/ray_table.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"
#include "sim/sample_pattern.h"

namespace diorama {

struct ColorPainter {
  const RenderScene& scene;
  LightView light;
  float brightest = 0;  // ExposureMotion::brightest

  // Pixels of a packet by one sharp sample in the middle of each. `hits` are those of `rays`, the
  // rays through the pixel centres.
  simd::Vector8 sharp(const PacketRays& packet, const RayPacket& rays,
                      const PacketHits& hits) const;

  // Pixels that show one patch over the whole exposure: light and highlight as in the middle, the
  // texture as each sample of the pattern sees it on the tangent plane.
  simd::Vector8 smooth(const PacketRays& packet, const RayPacket& rays, const PacketHits& hits,
                       const PatternRows& pattern) const;

  // Any pixel: each sample is hit and shaded by itself; all of them where the first half shows
  // contrast.
  Radiance sampled(const PacketRays& packet, size_t lane, const SamplePattern& pattern,
                   const NearbyHits& closest) const;
};

}  // namespace diorama
