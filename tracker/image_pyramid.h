// Half-sampled copies of a grey image, and its gradient.
#pragma once

#include <array>
#include <cstdint>

#include "core/image_sampling.h"

namespace diorama {

// The smaller copies alone: level 0 would be the image itself.
class ImagePyramid {
 public:
  static constexpr int kLevels = 4;

  // Halves by the mean of 2 x 2 pixels; an odd last row or column is dropped.
  void build(const Image<uint8_t>& image);

  const Image<uint8_t>& level(int l) const { return halved_[static_cast<size_t>(l) - 1]; }

 private:
  std::array<Image<uint8_t>, kLevels - 1> halved_;
};

// Half the difference of the neighbours at one pixel's distance; needs a margin of 1 px.
inline Vector2d sampleGradient(const Image<uint8_t>& image, float x, float y) {
  return 0.5 * Vector2d(sampleBilinear(image, x + 1, y) - sampleBilinear(image, x - 1, y),
                        sampleBilinear(image, x, y + 1) - sampleBilinear(image, x, y - 1));
}

}  // namespace diorama
