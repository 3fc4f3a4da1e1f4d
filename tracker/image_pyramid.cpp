#include "tracker/image_pyramid.h"

#include <cstring>

namespace diorama {
namespace {

void halve(const Image<uint8_t>& from, Image<uint8_t>& to) {
  to.width = from.width / 2;
  to.height = from.height / 2;
  to.pixels.resize(static_cast<size_t>(to.width) * static_cast<size_t>(to.height));
  const int width = to.width;  // a copy: the pixels written could be its bytes
  for (int y = 0; y < to.height; ++y) {
    const uint8_t* a = from.row(2 * y);
    const uint8_t* b = from.row(2 * y + 1);
    uint8_t* out = to.row(y);
    // Neighbours are read as one word, in any byte order: so the loop becomes vector code.
    for (int x = 0; x < width; ++x) {
      uint16_t pa, pb;
      std::memcpy(&pa, a + 2 * x, 2);
      std::memcpy(&pb, b + 2 * x, 2);
      out[x] = static_cast<uint8_t>(((pa & 255) + (pa >> 8) + (pb & 255) + (pb >> 8) + 2) >> 2);
    }
  }
}

}  // namespace

void ImagePyramid::build(const Image<uint8_t>& image) {
  base_ = &image;
  for (int l = 1; l < kLevels; ++l) halve(level(l - 1), halved_[static_cast<size_t>(l) - 1]);
}

}  // namespace diorama
