#include "sim/truth_buffer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/ray_table.h"

namespace diorama {

using simd::Float8;
using simd::Int8;

TruthBuffer::TruthBuffer(int padded_width, int padded_height)
    : stride_(padded_width),
      rows_(padded_height),
      depth_(static_cast<size_t>(padded_width) * static_cast<size_t>(padded_height)),
      inverse_depth_(depth_.size()),
      instance_(depth_.size()),
      patch_(depth_.size()),
      triangle_(depth_.size()),
      packets_(depth_.size() / 8) {}

void TruthBuffer::put(int x, int y, Float8 depth_m, Int8 instance, Int8 patch, Int8 triangle) {
  const bool even = simd::bits(patch != simd::splat(patch[0])) == 0;
  packets_[static_cast<size_t>(y / 2 * (stride_ / 4) + x / 4)] = even ? patch[0] : kUnknown;
  const Float8 inverse = simd::select(depth_m > 0.f, 1.f / depth_m, simd::splat(0.f));
  for (int row = 0; row < 2; ++row) {
    const auto copy = [row](auto* to, const auto& v) {
      std::memcpy(to, reinterpret_cast<const char*>(&v) + 16 * row, 16);
    };
    copy(&depth_[at(x, y + row)], depth_m);
    copy(&inverse_depth_[at(x, y + row)], inverse);
    copy(&instance_[at(x, y + row)], instance);
    copy(&patch_[at(x, y + row)], patch);
    copy(&triangle_[at(x, y + row)], triangle);
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
  for (int lane = 0; lane < 8; ++lane)
    if (isMixed(x + laneX(lane), y + laneY(lane), reach, width, height)) rough |= 1 << lane;
  return rough;
}

// Whether all packets that hold pixels up to `reach` from this packet's show one patch.
bool TruthBuffer::isEven(int x, int y, Reach reach) const {
  const int columns = stride_ / 4, rows = rows_ / 2;
  const int c0 = std::max(0, (x - reach.x) >> 2),
            c1 = std::min(columns - 1, (x + 3 + reach.x) >> 2);
  const int r0 = std::max(0, (y - reach.y) >> 1), r1 = std::min(rows - 1, (y + 1 + reach.y) >> 1);
  const int patch = packets_[static_cast<size_t>(y / 2 * columns + x / 4)];
  int differs = patch == kUnknown;
  for (int r = r0; r <= r1; ++r)
    for (int c = c0; c <= c1; ++c)
      differs |= patch ^ packets_[static_cast<size_t>(r * columns + c)];
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

VisibleTriangles TruthBuffer::trianglesAround(int x, int y, Reach reach, int width,
                                              int height) const {
  VisibleTriangles all;
  const int x0 = std::max(0, x - reach.x), x1 = std::min(width - 1, x + 3 + reach.x);
  const int y0 = std::max(0, y - reach.y), y1 = std::min(height - 1, y + 1 + reach.y);
  int last = -1;
  for (int v = y0; v <= y1; ++v)
    for (int u = x0; u <= x1; ++u) {
      const int triangle = triangle_[at(u, v)];
      all.nothing |= triangle < 0;
      if (triangle < 0 || triangle == last) continue;
      last = triangle;
      const auto end = all.triangle.begin() + all.count;
      if (std::find(all.triangle.begin(), end, triangle) != end) continue;
      if (all.count == VisibleTriangles::kMost) {
        ++all.count;
        return all;
      }
      all.triangle[static_cast<size_t>(all.count++)] = triangle;
    }
  return all;
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
