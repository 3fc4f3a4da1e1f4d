// Small scenes ready to be drawn.
#pragma once

#include <memory>

#include "sim/light_baker.h"

namespace diorama::test {

// With light that is baked quickly and coarsely.
inline std::shared_ptr<const RenderScene> lit(const Scene& scene, LightBakerOptions options = {}) {
  auto result = std::make_shared<RenderScene>(makeRenderScene(scene));
  WorkerPool pool(1);
  options.max_samples = 20000;
  options.bounces = 1;
  options.last_bounce_rays = 64;
  bakeLight(*result, options, pool);
  return result;
}

}  // namespace diorama::test
