#include "tracker/descriptor_index.h"

#include <algorithm>
#include <limits>

namespace diorama {
namespace {

constexpr size_t kPerCell = 64, kMostCells = 256;
constexpr size_t kProbes = 8;     // cells that a query looks through
constexpr size_t kSample = 4096;  // descriptors that the clustering is made from
constexpr int kIterations = 4;

int squaredDistance(const uint8_t* a, const uint8_t* b, size_t size) {
  int sum = 0;
  for (size_t i = 0; i < size; ++i) {
    const int16_t d = static_cast<int16_t>(a[i] - b[i]);
    sum += d * d;
  }
  return sum;
}

}  // namespace

DescriptorIndex::DescriptorIndex(const std::vector<uint8_t>& descriptors, int size)
    : size_(static_cast<size_t>(size)) {
  if (descriptors.empty()) return;
  cluster(descriptors);
  sortIn(descriptors);
}

// Lloyd's algorithm on evenly spaced descriptors.
void DescriptorIndex::cluster(const std::vector<uint8_t>& descriptors) {
  const size_t n = descriptors.size() / size_;
  const size_t cells = std::clamp(n / kPerCell, size_t{1}, kMostCells);
  const auto row = [&](size_t k, size_t of) { return descriptors.data() + k * n / of * size_; };
  for (size_t k = 0; k < cells; ++k)
    centres_.insert(centres_.end(), row(k, cells), row(k, cells) + size_);
  const size_t sample = std::min(n, kSample);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<uint32_t> sums(centres_.size(), 0), counts(cells, 0);
    for (size_t k = 0; k < sample; ++k) {
      const uint8_t* const descriptor = row(k, sample);
      const size_t cell = nearestCell(descriptor);
      ++counts[cell];
      for (size_t i = 0; i < size_; ++i) sums[cell * size_ + i] += descriptor[i];
    }
    for (size_t i = 0; i < sums.size(); ++i)
      if (const uint32_t count = counts[i / size_])
        centres_[i] = static_cast<uint8_t>((sums[i] + count / 2) / count);
  }
}

void DescriptorIndex::sortIn(const std::vector<uint8_t>& descriptors) {
  const size_t n = descriptors.size() / size_, cells = centres_.size() / size_;
  std::vector<std::vector<int>> members(cells);
  for (size_t k = 0; k < n; ++k)
    members[nearestCell(descriptors.data() + k * size_)].push_back(static_cast<int>(k));
  begins_.push_back(0);
  for (const std::vector<int>& cell : members) {
    for (const int k : cell) {
      const uint8_t* const descriptor = descriptors.data() + static_cast<size_t>(k) * size_;
      rows_.insert(rows_.end(), descriptor, descriptor + size_);
      indices_.push_back(k);
    }
    begins_.push_back(indices_.size());
  }
}

size_t DescriptorIndex::nearestCell(const uint8_t* descriptor) const {
  size_t best = 0;
  int least = std::numeric_limits<int>::max();
  for (size_t cell = 0; cell * size_ < centres_.size(); ++cell) {
    const int square = squaredDistance(descriptor, centres_.data() + cell * size_, size_);
    if (square < least) {
      least = square;
      best = cell;
    }
  }
  return best;
}

namespace {

// Keeps the list sorted; of equals the first one comes first.
template <size_t n>
void insert(std::array<DescriptorIndex::Neighbour, n>& nearest, int index, int square) {
  if (nearest.back().index >= 0 && square >= nearest.back().square) return;
  size_t k = n - 1;
  for (; k > 0 && (nearest[k - 1].index < 0 || nearest[k - 1].square > square); --k)
    nearest[k] = nearest[k - 1];
  nearest[k] = {index, square};
}

}  // namespace

DescriptorIndex::Neighbours DescriptorIndex::find(const uint8_t* query) const {
  std::array<Neighbour, kProbes> cells;
  for (size_t cell = 0; cell * size_ < centres_.size(); ++cell)
    insert(cells, static_cast<int>(cell),
           squaredDistance(query, centres_.data() + cell * size_, size_));
  Neighbours found;
  for (const Neighbour& cell : cells) {
    if (cell.index < 0) break;
    const size_t k = static_cast<size_t>(cell.index);
    for (size_t i = begins_[k]; i < begins_[k + 1]; ++i)
      insert(found, indices_[i], squaredDistance(query, rows_.data() + i * size_, size_));
  }
  return found;
}

}  // namespace diorama
