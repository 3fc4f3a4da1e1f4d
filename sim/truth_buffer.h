// Depth and instance id at pixel centres while a frame is being drawn.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "sim/renderer.h"
#include "sim/simd.h"

namespace diorama {

// Different triangles in some pixels, in the order in which they were met.
struct VisibleTriangles {
  static constexpr int kMost = 24;
  int count = 0;  // kMost + 1: more than are listed
  std::array<int, kMost> triangle{};
  bool nothing = false;  // some pixels show no triangle

  void add(int t) {
    if (count > kMost) return;
    for (int k = 0; k < count; ++k)
      if (triangle[static_cast<size_t>(k)] == t) return;
    if (count < kMost) triangle[static_cast<size_t>(count)] = t;
    ++count;
  }
};

// Rows are padded to whole tiles; threads write disjoint packets.
class TruthBuffer {
 public:
  TruthBuffer(int padded_width, int padded_height);

  // A packet of two rows of four pixels, the first row in lanes 0-3; triangle -1 where nothing is
  // hit. Lanes that are not valid show nothing of interest.
  void put(int x, int y, simd::Float8 depth_m, simd::Int8 instance, simd::Int8 triangle,
           simd::Int8 valid);

  float depth(int x, int y) const { return depth_[at(x, y)]; }  // 0 = nothing hit
  int instance(int x, int y) const { return instance_[at(x, y)]; }

  // Whether an outline or crease passes the 4 x 2 pixels at (x, y) or their neighbours: instances
  // differ, or inverse depth, which is linear in the image of a plane, bends.
  bool hasEdge(int x, int y, int width, int height) const;

  // All that the packet at (x, y) and the packets around it show, `columns` to the left and right
  // and `rows` upwards and downwards. Nothing when that is too much or reaches beyond the image.
  std::optional<VisibleTriangles> trianglesAround(int x, int y, int columns, int rows) const;

  void copyTo(RenderedFrame& frame, int width, int height) const;

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(stride_) + static_cast<size_t>(x);
  }
  int stride_;
  std::vector<float> depth_, inverse_depth_;
  std::vector<int> instance_;
  std::vector<VisibleTriangles> packets_;  // rows of stride_ / 4
};

}  // namespace diorama
