// Disjoint sets of the corners of a mesh.
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace diorama {

class CornerSets {
 public:
  explicit CornerSets(size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }
  uint32_t find(uint32_t corner) {  // with path halving
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }
  void join(uint32_t a, uint32_t b) { parent_[find(a)] = find(b); }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace diorama
