#include "sim/y4m_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace diorama {
namespace {

constexpr int kBits = 16;  // of the fixed-point coefficients

int fixed(double coefficient) { return static_cast<int>(std::lround(coefficient * (1 << kBits))); }

char rounded(int fixed_point) {
  const int value = (fixed_point + (1 << (kBits - 1))) >> kBits;
  return static_cast<char>(std::clamp(value, 0, 255));
}

}  // namespace

std::string y4mHeader(int width, int height, double rate_hz) {
  int64_t numerator = std::llround(1000 * rate_hz), denominator = 1000;
  const int64_t common = std::gcd(numerator, denominator);
  return "YUV4MPEG2 W" + std::to_string(width) + " H" + std::to_string(height) + " F" +
         std::to_string(numerator / common) + ":" + std::to_string(denominator / common) +
         " Ip A1:1 C444 XCOLORRANGE=FULL\n";
}

std::string y4mFrame(const Image<Rgb8>& image) {
  // Y = 0.299 R + 0.587 G + 0.114 B, Cb = (B - Y) / 1.772 + 128, Cr = (R - Y) / 1.402 + 128.
  static const int yr = fixed(0.299), yb = fixed(0.114), yg = (1 << kBits) - yr - yb;
  static const int br = fixed(-0.299 / 1.772), bb = fixed(0.5), bg = -br - bb;
  static const int rr = fixed(0.5), rb = fixed(-0.114 / 1.402), rg = -rr - rb;
  constexpr int kMiddle = 128 << kBits;
  const std::string head = "FRAME\n";
  const size_t n = image.pixels.size();
  std::string text(head.size() + 3 * n, '\0');
  text.replace(0, head.size(), head);
  char *y = text.data() + head.size(), *cb = y + n, *cr = cb + n;
  for (const Rgb8& p : image.pixels) {
    *y++ = rounded(yr * p.r + yg * p.g + yb * p.b);
    *cb++ = rounded(br * p.r + bg * p.g + bb * p.b + kMiddle);
    *cr++ = rounded(rr * p.r + rg * p.g + rb * p.b + kMiddle);
  }
  return text;
}

}  // namespace diorama
