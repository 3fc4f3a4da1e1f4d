#include "vo/image_pyramid.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <utility>

namespace diorama::vo {
namespace {

constexpr int kSmallestSide = 16;  // px: less holds no patch with its surroundings

}  // namespace

ImagePyramid::ImagePyramid(const Image<uint8_t>& image, int levels) {
  levels_.reserve(static_cast<size_t>(levels));
  levels_.push_back(image);
  while (static_cast<int>(levels_.size()) < levels &&
         std::min(levels_.back().width, levels_.back().height) / 2 >= kSmallestSide) {
    Image<uint8_t> half;
    halve(levels_.back(), half);
    levels_.push_back(std::move(half));
  }
}

double imageNoise(const Image<uint8_t>& image) {
  constexpr int kStep = 5;           // a sample of the pixels is enough
  constexpr int kLargest = 8 * 255;  // of a response
  std::array<int, kLargest + 1> counts{};
  int total = 0;
  for (int y = 1; y + 1 < image.height; y += kStep) {
    const uint8_t *a = image.row(y - 1), *b = image.row(y), *c = image.row(y + 1);
    for (int x = 1 + y % kStep; x + 1 < image.width; x += kStep, ++total)
      ++counts[static_cast<size_t>(std::abs(a[x - 1] - 2 * a[x] + a[x + 1] - 2 * b[x - 1] +
                                            4 * b[x] - 2 * b[x + 1] + c[x - 1] - 2 * c[x] +
                                            c[x + 1]))];
  }
  if (total == 0) return 0;
  size_t median = 0;
  for (int below = counts[0]; below <= total / 2; below += counts[median]) ++median;
  // The mask's coefficients have the norm 6; 0.6745 is the median of |N(0, 1)|.
  return static_cast<double>(median) / (6 * 0.6745);
}

}  // namespace diorama::vo
