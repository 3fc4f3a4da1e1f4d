// Half-sampled copies of a grey image, square blocks read between pixels, and the image's noise.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/image_sampling.h"

namespace diorama::vo {

class ImagePyramid {
 public:
  // Halves by the mean of 2 x 2 pixels, up to `levels` levels as long as 16 pixels remain.
  ImagePyramid(const Image<uint8_t>& image, int levels);

  int levels() const { return static_cast<int>(levels_.size()); }
  const Image<uint8_t>& level(int l) const { return levels_[static_cast<size_t>(l)]; }

 private:
  std::vector<Image<uint8_t>> levels_;
};

// Standard deviation of the noise, grey levels: median of a Laplacian that structure hardly answers
// to (Immerkaer 1996).
double imageNoise(const Image<uint8_t>& image);

// Reads N x N values around `centre`, at offsets -N/2 .. N/2 - 1 (N even) or -N/2 .. N/2 (odd),
// bilinearly. False, and nothing read, where that leaves the image or the centre is not finite.
template <int N>
bool sampleBlock(const Image<uint8_t>& image, const Vector2d& centre, float* values) {
  const double x = centre.x() - N / 2, y = centre.y() - N / 2;
  if (!(x >= 0 && y >= 0 && x < image.width - N && y < image.height - N)) return false;
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const float a = static_cast<float>(x - xi), b = static_cast<float>(y - yi);
  const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
  // Copied first, so that the rest is done in vectors.
  constexpr int kSide = N + 1;
  std::array<uint8_t, kSide * kSide> bytes;
  std::array<float, kSide * kSide> pixels;
  for (int r = 0; r < kSide; ++r)
    std::copy_n(image.row(yi + r) + xi, kSide, &bytes[static_cast<size_t>(r * kSide)]);
  for (size_t i = 0; i < pixels.size(); ++i) pixels[i] = bytes[i];
  for (int r = 0; r < N; ++r) {
    const float* __restrict p = &pixels[static_cast<size_t>(r * kSide)];
    const float* __restrict q = p + kSide;
    float* __restrict value = values + r * N;
    for (int c = 0; c < N; ++c)
      value[c] = w00 * p[c] + w01 * p[c + 1] + w10 * q[c] + w11 * q[c + 1];
  }
  return true;
}

}  // namespace diorama::vo
