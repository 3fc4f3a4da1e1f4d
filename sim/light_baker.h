// Diffuse light of a static scene, computed once: direct light of the area lights with soft
// shadows, emissive surfaces, the sky, and several bounces. The result is a grid of samples on each
// triangle (docs/adr/0001-baked-light.md).
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "sim/render_scene.h"
#include "sim/worker_pool.h"

namespace diorama {

struct LightBakerOptions {
  double spacing_m = 0.004;       // of samples near the objects
  double spacing_growth = 0.012;  // metres more per metre of distance from the objects
  int max_samples = 1'600'000;    // the spacing is widened until they suffice
  int shadow_rays = 32;           // per light and sample, where a light is partly hidden
  int bounces = 4;
  int bounce_rays = 16;  // per sample in all bounces but the last
  int last_bounce_rays = 256;
  float surface_offset_m = 2e-4f;  // rays start this far above their surface
};

// The same bytes for any number of threads.
void bakeLight(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool);

// The same from cacheFolder()/light, where it was baked before for the same content; a file that is
// damaged or not of this content is baked anew. A cache that cannot be written is no error.
void loadOrBakeLight(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool,
                     const std::function<void()>& before_baking = {});

}  // namespace diorama
