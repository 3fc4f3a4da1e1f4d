#include "core/image.h"

namespace diorama {

Image<uint8_t> toGray(const Image<Rgb8>& rgb) {
  Image<uint8_t> gray(rgb.width, rgb.height);
  // Bytes may be anybody's: only by pointers of its own does the compiler take many at once.
  const Rgb8* in = rgb.pixels.data();
  uint8_t* __restrict out = gray.pixels.data();
  const size_t count = gray.pixels.size();
  // 0.299, 0.587, 0.114 in 16 bit fixed point; the weights add up to 65536.
  for (size_t i = 0; i < count; ++i)
    out[i] = static_cast<uint8_t>(
        (19595u * in[i].r + 38470u * in[i].g + 7471u * in[i].b + 32768u) >> 16);
  return gray;
}

}  // namespace diorama
