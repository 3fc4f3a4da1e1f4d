#include "tracker/image_pyramid.h"

namespace diorama {
namespace {

void halve(const Image<uint8_t>& from, Image<uint8_t>& to) {
  to.width = from.width / 2;
  to.height = from.height / 2;
  to.pixels.resize(static_cast<size_t>(to.width) * static_cast<size_t>(to.height));
  for (int y = 0; y < to.height; ++y) {
    const uint8_t* a = from.row(2 * y);
    const uint8_t* b = from.row(2 * y + 1);
    uint8_t* out = to.row(y);
    for (int x = 0; x < to.width; ++x) {
      const int sum = a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1];
      out[x] = static_cast<uint8_t>((sum + 2) >> 2);
    }
  }
}

}  // namespace

void ImagePyramid::build(const Image<uint8_t>& image) {
  base_ = &image;
  for (int l = 1; l < kLevels; ++l) halve(level(l - 1), halved_[static_cast<size_t>(l) - 1]);
}

}  // namespace diorama
