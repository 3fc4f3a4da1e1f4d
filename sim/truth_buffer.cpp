#include "sim/truth_buffer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sim/ray_table.h"

namespace diorama {

using simd::Float8;
using simd::Int8;

namespace {
constexpr float kInfinity = std::numeric_limits<float>::infinity();
}  // namespace

TruthBuffer::TruthBuffer(int padded_width, int padded_height)
    : stride_(padded_width),
      rows_(padded_height),
      depth_(static_cast<size_t>(padded_width) * static_cast<size_t>(padded_height)),
      inverse_depth_(depth_.size()),
      instance_(depth_.size()),
      patch_(depth_.size()),
      packets_(depth_.size() / 8),
      packets_farthest_(depth_.size() / 8) {}

void TruthBuffer::put(int x, int y, Float8 depth_m, Int8 instance, Int8 patch) {
  const bool even = simd::bits(patch != simd::splat(patch[0])) == 0;
  const Float8 inverse = simd::select(depth_m > 0.f, 1.f / depth_m, simd::splat(0.f));
  const Int8 no_ray = (depth_m <= 0.f) & (patch == simd::splat(kUnknown));
  const auto packet = static_cast<size_t>(y / 2 * (stride_ / 4) + x / 4);
  packets_[packet] = even ? patch[0] : kUnknown;
  packets_farthest_[packet] = simd::least(simd::select(no_ray, simd::splat(kInfinity), inverse));
  for (int row = 0; row < 2; ++row) {
    const auto copy = [row](auto* to, const auto& v) {
      std::memcpy(to, reinterpret_cast<const char*>(&v) + 16 * row, 16);
    };
    copy(&depth_[at(x, y + row)], depth_m);
    copy(&inverse_depth_[at(x, y + row)], inverse);
    copy(&instance_[at(x, y + row)], instance);
    copy(&patch_[at(x, y + row)], patch);
  }
}

bool TruthBuffer::hasEdge(int x, int y, int width, int height) const {
  constexpr float kBend = 0.02f;  // of the inverse depth, per pixel squared
  if (x < 1 || y < 1 || x + 5 > width || y + 3 > height) return true;  // border: no neighbours
  const int* id = &instance_[at(x, y)];
  const float* z = &inverse_depth_[at(x, y)];
  int differs = 0;
  float bend = 0;
  for (int k = 0; k < 8; ++k) {
    const int offset = (k & 3) + (k >> 2) * stride_;
    const int center = id[offset];
    differs |= (center ^ id[offset - 1]) | (center ^ id[offset + 1]) |
               (center ^ id[offset - stride_]) | (center ^ id[offset + stride_]);
    const float c = z[offset];
    bend = std::max({bend, std::abs(z[offset - 1] + z[offset + 1] - 2 * c),
                     std::abs(z[offset - stride_] + z[offset + stride_] - 2 * c)});
  }
  return differs != 0 || bend > kBend * z[0];
}

int TruthBuffer::roughPixels(int x, int y, Reach reach, int width, int height) const {
  int rough = bentPixels(x, y, reach);
  if (isEven(x, y, reach)) return rough;
  if (x >= reach.x && y >= reach.y && x + 4 + reach.x <= width && y + 2 + reach.y <= height)
    return rough | mixedPixels(x, y, reach);
  for (int lane = 0; lane < 8; ++lane)
    if (isMixed(x + laneX(lane), y + laneY(lane), reach, width, height)) rough |= 1 << lane;
  return rough;
}

// All packets that hold pixels up to `reach` from four columns and `height` rows.
template <class Visit>
void TruthBuffer::visitPackets(int x, int y, int height, Reach reach, const Visit& visit) const {
  const int columns = stride_ / 4, rows = rows_ / 2;
  const int c0 = std::max(0, (x - reach.x) >> 2),
            c1 = std::min(columns - 1, (x + 3 + reach.x) >> 2);
  const int r0 = std::max(0, (y - reach.y) >> 1),
            r1 = std::min(rows - 1, (y + height - 1 + reach.y) >> 1);
  for (int r = r0; r <= r1; ++r)
    for (int c = c0; c <= c1; ++c) visit(static_cast<size_t>(r * columns + c));
}

// Whether a packet and its neighbours show one patch.
bool TruthBuffer::isEven(int x, int y, Reach reach) const {
  const int patch = packets_[static_cast<size_t>(y / 2 * (stride_ / 4) + x / 4)];
  int differs = patch == kUnknown;
  visitPackets(x, y, 2, reach, [&](size_t packet) { differs |= patch ^ packets_[packet]; });
  return differs == 0;
}

bool TruthBuffer::isMixed(int x, int y, Reach reach, int width, int height) const {
  const int patch = patch_[at(x, y)];
  if (patch == kUnknown) return true;
  const int x0 = std::max(0, x - reach.x), x1 = std::min(width - 1, x + reach.x);
  const int y0 = std::max(0, y - reach.y), y1 = std::min(height - 1, y + reach.y);
  int differs = 0;
  for (int v = y0; v <= y1; ++v)
    for (int u = x0; u <= x1; ++u) differs |= patch ^ patch_[at(u, v)];
  return differs != 0;
}

// All pixels of a packet at once, where its neighbourhood lies in the image.
int TruthBuffer::mixedPixels(int x, int y, Reach reach) const {
  const auto values = [&](int u, int v) {
    const int* p = &patch_[at(u, v)];
    return simd::load2(p, p + stride_);
  };
  const Int8 patch = values(x, y);
  Int8 differs = patch == simd::splat(kUnknown);
  for (int v = -reach.y; v <= reach.y; ++v)
    for (int u = -reach.x; u <= reach.x; ++u) differs |= patch ^ values(x + u, y + v);
  return simd::bits(differs != simd::splat(0));
}

// Inverse depth, which is linear in the image of a plane, departs from the line through its values
// `reach` to both sides.
int TruthBuffer::bentPixels(int x, int y, Reach reach) const {
  constexpr float kBend = 0.003f;  // of the inverse depth
  if (x < reach.x || y < reach.y || x + 4 + reach.x > stride_ || y + 2 + reach.y > rows_) return 0;
  const auto values = [&](int dx, int dy) {
    const float* z = &inverse_depth_[at(x + dx, y + dy)];
    return simd::load2(z, z + stride_);
  };
  const Float8 z = values(0, 0), twice = 2.f * z;
  const Float8 bend = simd::max(simd::abs(values(-reach.x, 0) + values(reach.x, 0) - twice),
                                simd::abs(values(0, -reach.y) + values(0, reach.y) - twice));
  return simd::bits(bend > kBend * z);
}

float TruthBuffer::leastInverseDepth(int x, int y, Reach reach) const {
  float least = kInfinity;
  visitPackets(x, y, 4, reach,
               [&](size_t packet) { least = std::min(least, packets_farthest_[packet]); });
  return least;
}

void TruthBuffer::copyTo(RenderedFrame& frame, int width, int height) const {
  frame.depth_m = Image<float>(width, height);
  frame.instance_id = Image<uint16_t>(width, height);
  for (int y = 0; y < height; ++y) {
    std::copy_n(&depth_[at(0, y)], width, frame.depth_m.row(y));
    std::transform(&instance_[at(0, y)], &instance_[at(0, y)] + width, frame.instance_id.row(y),
                   [](int id) { return static_cast<uint16_t>(id); });
  }
}

}  // namespace diorama
