#include "core/image.h"

namespace diorama {

Image<uint8_t> toGray(const Image<Rgb8>& rgb) {
  Image<uint8_t> gray(rgb.width, rgb.height);
  for (size_t i = 0; i < rgb.pixels.size(); ++i) {
    const Rgb8& p = rgb.pixels[i];
    // 0.299, 0.587, 0.114 in 16 bit fixed point; the weights add up to 65536.
    gray.pixels[i] =
        static_cast<uint8_t>((19595u * p.r + 38470u * p.g + 7471u * p.b + 32768u) >> 16);
  }
  return gray;
}

}  // namespace diorama
