#include "sim/patches.h"

#include <map>
#include <utility>

#include "sim/corner_sets.h"

namespace diorama {

void findPatches(RenderScene& scene) {
  CornerSets sets(scene.corners.size());
  for (size_t k = 0; k < scene.indices.size(); k += 3)
    for (size_t other : {k + 1, k + 2}) sets.join(scene.indices[k], scene.indices[other]);
  std::map<std::pair<uint32_t, int>, int> numbers;  // of (set, material)
  for (size_t k = 0; k < scene.triangles.size(); ++k) {
    ShadingTriangle& t = scene.triangles[k];
    const auto next = static_cast<int>(numbers.size()) + 1;
    t.patch =
        numbers.try_emplace({sets.find(scene.indices[3 * k]), t.material}, next).first->second;
  }
}

}  // namespace diorama
