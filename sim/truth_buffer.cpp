#include "sim/truth_buffer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace diorama {

TruthBuffer::TruthBuffer(int padded_width, int padded_height)
    : stride_(padded_width),
      depth_(static_cast<size_t>(padded_width) * static_cast<size_t>(padded_height)),
      inverse_depth_(depth_.size()),
      instance_(depth_.size()),
      packets_(depth_.size() / 8) {}

void TruthBuffer::put(int x, int y, simd::Float8 depth_m, simd::Int8 instance, simd::Int8 triangle,
                      simd::Int8 valid) {
  VisibleTriangles visible;
  for (int lane = 0; lane < 8 && visible.count <= VisibleTriangles::kMost; ++lane) {
    if (!valid[lane]) continue;
    if (triangle[lane] < 0)
      visible.nothing = true;
    else
      visible.add(triangle[lane]);
  }
  packets_[static_cast<size_t>(y / 2 * (stride_ / 4) + x / 4)] = visible;
  const simd::Float8 inverse = simd::select(depth_m > 0.f, 1.f / depth_m, simd::splat(0.f));
  for (int row = 0; row < 2; ++row) {
    const auto copy = [row](auto* to, const auto& v) {
      std::memcpy(to, reinterpret_cast<const char*>(&v) + 16 * row, 16);
    };
    copy(&depth_[at(x, y + row)], depth_m);
    copy(&inverse_depth_[at(x, y + row)], inverse);
    copy(&instance_[at(x, y + row)], instance);
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

std::optional<VisibleTriangles> TruthBuffer::trianglesAround(int x, int y, int columns,
                                                             int rows) const {
  const int all_columns = stride_ / 4, all_rows = static_cast<int>(packets_.size()) / all_columns;
  const int column = x / 4, row = y / 2;
  if (column < columns || column + columns >= all_columns || row < rows || row + rows >= all_rows)
    return std::nullopt;
  const VisibleTriangles* center = &packets_[static_cast<size_t>(row * all_columns + column)];
  VisibleTriangles all = *center;
  for (int r = -rows; r <= rows; ++r)
    for (int c = -columns; c <= columns; ++c) {
      const VisibleTriangles& one = center[r * all_columns + c];
      if (one.count > VisibleTriangles::kMost) return std::nullopt;
      for (int k = 0; k < one.count; ++k) all.add(one.triangle[static_cast<size_t>(k)]);
      if (all.count > VisibleTriangles::kMost) return std::nullopt;
      all.nothing |= one.nothing;
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
