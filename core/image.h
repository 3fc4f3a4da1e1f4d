// A dense image in row-major order without padding. Pixel (0, 0) is a pixel centre; the image spans
// [-0.5, width - 0.5] x [-0.5, height - 0.5].
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace diorama {

template <class T>
struct Image {
  int width = 0;
  int height = 0;
  std::vector<T> pixels;

  Image() = default;
  Image(int width_px, int height_px, T value = T{})
      : width(width_px),
        height(height_px),
        pixels(static_cast<size_t>(width_px) * static_cast<size_t>(height_px), value) {}

  bool empty() const { return pixels.empty(); }
  T* row(int y) { return pixels.data() + static_cast<size_t>(y) * static_cast<size_t>(width); }
  const T* row(int y) const {
    return pixels.data() + static_cast<size_t>(y) * static_cast<size_t>(width);
  }
  T& operator()(int x, int y) { return row(y)[x]; }
  const T& operator()(int x, int y) const { return row(y)[x]; }

  friend bool operator==(const Image&, const Image&) = default;
};

struct Rgb8 {
  uint8_t r = 0, g = 0, b = 0;
  friend bool operator==(const Rgb8&, const Rgb8&) = default;
};

struct Rgb16 {
  uint16_t r = 0, g = 0, b = 0;
  friend bool operator==(const Rgb16&, const Rgb16&) = default;
};

// Luma of ITU-R BT.601, rounded.
Image<uint8_t> toGray(const Image<Rgb8>& rgb);

}  // namespace diorama
