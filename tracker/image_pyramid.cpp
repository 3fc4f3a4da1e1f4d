#include "tracker/image_pyramid.h"

namespace diorama {

void ImagePyramid::build(const Image<uint8_t>& image) {
  base_ = &image;
  for (int l = 1; l < kLevels; ++l) halve(level(l - 1), halved_[static_cast<size_t>(l) - 1]);
}

}  // namespace diorama
