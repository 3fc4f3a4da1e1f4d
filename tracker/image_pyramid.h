// Half-sampled copies of a grey image, and reading between pixels.
#pragma once

#include <array>
#include <cstdint>

#include "core/image.h"
#include "core/types.h"

namespace diorama {

// Level l has pixels of 2^l x 2^l pixels of the image: u_l = (u + 0.5) / 2^l - 0.5.
inline double levelScale(int level) { return 1.0 / (1 << level); }
inline double toLevel(double u_px, int level) { return (u_px + 0.5) * levelScale(level) - 0.5; }
inline Vector2d fromLevel(const Vector2d& u_level, int level) {
  return (u_level.array() + 0.5) / levelScale(level) - 0.5;
}

// A view of the given image and its copies: valid as long as the image.
class ImagePyramid {
 public:
  static constexpr int kLevels = 4;

  // Halves by the mean of 2 x 2 pixels; an odd last row or column is dropped.
  void build(const Image<uint8_t>& image);

  const Image<uint8_t>& level(int l) const {
    return l == 0 ? *base_ : halved_[static_cast<size_t>(l) - 1];
  }

 private:
  const Image<uint8_t>* base_ = nullptr;
  std::array<Image<uint8_t>, kLevels - 1> halved_;
};

// Whether sampleBilinear() may read at (x, y) and margin_px around it. False for NaN.
inline bool canSample(const Image<uint8_t>& image, double x, double y, double margin_px = 0) {
  return x >= margin_px && y >= margin_px && x < image.width - 1 - margin_px &&
         y < image.height - 1 - margin_px;
}

inline float sampleBilinear(const Image<uint8_t>& image, float x, float y) {
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const float a = x - static_cast<float>(xi), b = y - static_cast<float>(yi);
  const uint8_t* p = image.row(yi) + xi;
  const uint8_t* q = p + image.width;
  const float top = static_cast<float>(p[0]) + a * static_cast<float>(p[1] - p[0]);
  const float bottom = static_cast<float>(q[0]) + a * static_cast<float>(q[1] - q[0]);
  return top + b * (bottom - top);
}

// Half the difference of the neighbours at one pixel's distance; needs a margin of 1 px.
inline Vector2d sampleGradient(const Image<uint8_t>& image, float x, float y) {
  return 0.5 * Vector2d(sampleBilinear(image, x + 1, y) - sampleBilinear(image, x - 1, y),
                        sampleBilinear(image, x, y + 1) - sampleBilinear(image, x, y - 1));
}

}  // namespace diorama
