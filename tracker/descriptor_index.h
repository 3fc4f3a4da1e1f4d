// The nearest of many descriptors, approximately.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace diorama {

// An inverted file (Jegou, Douze and Schmid, Product quantization for nearest neighbor search, PAMI
// 2011, without the quantisation of what is left): descriptors lie in the cells of a k-means
// clustering, and a query looks through the nearest cells only. In whole numbers, so that the same
// descriptors give the same neighbours on every machine.
class DescriptorIndex {
 public:
  static constexpr int kNeighbours = 8;
  struct Neighbour {
    int index = -1;  // -1: there is none
    int square = 0;  // of the Euclidean distance
  };
  using Neighbours = std::array<Neighbour, kNeighbours>;  // the nearest first

  // `size` bytes each.
  DescriptorIndex(const std::vector<uint8_t>& descriptors, int size);

  Neighbours find(const uint8_t* query) const;

 private:
  void cluster(const std::vector<uint8_t>& descriptors);
  void sortIn(const std::vector<uint8_t>& descriptors);
  size_t nearestCell(const uint8_t* descriptor) const;

  size_t size_;
  std::vector<uint8_t> centres_;  // of the cells
  std::vector<size_t> begins_;    // of each cell in the lists below, and the end
  std::vector<uint8_t> rows_;
  std::vector<int> indices_;
};

}  // namespace diorama
