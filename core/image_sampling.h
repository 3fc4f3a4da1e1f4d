// Reading grey images between pixels, and at half their size.
#pragma once

#include <cstdint>

#include "core/image.h"
#include "core/types.h"

namespace diorama {

// Level l of a pyramid has pixels of 2^l x 2^l pixels of the image: u_l = (u + 0.5) / 2^l - 0.5.
inline double levelScale(int level) { return 1.0 / (1 << level); }
inline double toLevel(double u_px, int level) { return (u_px + 0.5) * levelScale(level) - 0.5; }
inline Vector2d toLevel(const Vector2d& u_px, int level) {
  return {toLevel(u_px.x(), level), toLevel(u_px.y(), level)};
}
inline Vector2d fromLevel(const Vector2d& u_level, int level) {
  return (u_level.array() + 0.5) / levelScale(level) - 0.5;
}

// The means of 2 x 2 pixels, rounded; an odd last row or column is dropped. Reuses the memory of
// `half`.
void halve(const Image<uint8_t>& image, Image<uint8_t>& half);

// Whether sampleBilinear() may read at (x, y) and margin_px around it. False for NaN.
inline bool canSample(const Image<uint8_t>& image, double x, double y, double margin_px = 0) {
  return x >= margin_px && y >= margin_px && x < image.width - 1 - margin_px &&
         y < image.height - 1 - margin_px;
}

// Between values that a function gives of the pixels.
template <class Value>
float sampleBilinear(const Image<uint8_t>& image, float x, float y, const Value& value) {
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const float a = x - static_cast<float>(xi), b = y - static_cast<float>(yi);
  const uint8_t* p = image.row(yi) + xi;
  const uint8_t* q = p + image.width;
  const float p0 = value(p[0]), q0 = value(q[0]);
  const float top = p0 + a * (value(p[1]) - p0), bottom = q0 + a * (value(q[1]) - q0);
  return top + b * (bottom - top);
}
inline float sampleBilinear(const Image<uint8_t>& image, float x, float y) {
  return sampleBilinear(image, x, y, [](uint8_t grey) { return static_cast<float>(grey); });
}

}  // namespace diorama
