#include "tracker/image_pyramid.h"

namespace diorama {

void ImagePyramid::build(const Image<uint8_t>& image) {
  halve(image, halved_[0]);
  for (size_t l = 1; l < halved_.size(); ++l) halve(halved_[l - 1], halved_[l]);
}

}  // namespace diorama
