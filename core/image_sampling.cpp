#include "core/image_sampling.h"

#include <cstring>

namespace diorama {

void halve(const Image<uint8_t>& image, Image<uint8_t>& half) {
  half.width = image.width / 2;
  half.height = image.height / 2;
  half.pixels.resize(static_cast<size_t>(half.width) * static_cast<size_t>(half.height));
  const int width = half.width;  // a copy: the pixels written could be its bytes
  for (int y = 0; y < half.height; ++y) {
    const uint8_t* a = image.row(2 * y);
    const uint8_t* b = image.row(2 * y + 1);
    uint8_t* out = half.row(y);
    // Neighbours are read as one word, in any byte order: so the loop becomes vector code.
    for (int x = 0; x < width; ++x) {
      uint16_t pa, pb;
      std::memcpy(&pa, a + 2 * x, 2);
      std::memcpy(&pb, b + 2 * x, 2);
      out[x] = static_cast<uint8_t>(((pa & 255) + (pa >> 8) + (pb & 255) + (pb >> 8) + 2) >> 2);
    }
  }
}

}  // namespace diorama
