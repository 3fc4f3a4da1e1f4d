// Asks the memory for what will be read soon.
#pragma once

#include "sim/render_scene.h"

namespace diorama {

// All that shading reads of a triangle: two cache lines that hardly ever lie in the caches.
inline void prefetchTriangle(const RenderScene& scene, uint32_t triangle) {
  const auto* bytes = reinterpret_cast<const char*>(&scene.triangles[triangle]);
  __builtin_prefetch(bytes);
  __builtin_prefetch(bytes + sizeof(ShadingTriangle) / 2);
}

}  // namespace diorama
