#include "sim/patches.h"

#include <map>
#include <numeric>
#include <utility>
#include <vector>

namespace diorama {
namespace {

// Disjoint sets of corners, with path halving.
class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t find(uint32_t corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  void join(uint32_t a, uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace

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
