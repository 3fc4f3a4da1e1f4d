// Depth and instance id at pixel centres while a frame is being drawn.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/renderer.h"
#include "sim/simd.h"

namespace diorama {

// Rows are padded to whole tiles; threads write disjoint packets.
class TruthBuffer {
 public:
  TruthBuffer(int padded_width, int padded_height);

  // A packet of two rows of four pixels, the first row in lanes 0-3. `triangle` is what all of them
  // show, or -1.
  void put(int x, int y, simd::Float8 depth_m, simd::Int8 instance, int triangle);

  float depth(int x, int y) const { return depth_[at(x, y)]; }  // 0 = nothing hit
  int instance(int x, int y) const { return instance_[at(x, y)]; }

  // Whether an outline or crease passes the 4 x 2 pixels at (x, y) or their neighbours: instances
  // differ, or inverse depth, which is linear in the image of a plane, bends.
  bool hasEdge(int x, int y, int width, int height) const;

  // The triangle that the packet at (x, y) and all packets around it show, one to the left and
  // right and `rows` upwards and downwards; -1 when they differ. What lies between shows it as
  // well.
  int commonTriangle(int x, int y, int rows) const;

  void copyTo(RenderedFrame& frame, int width, int height) const;

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(stride_) + static_cast<size_t>(x);
  }
  int stride_;
  std::vector<float> depth_, inverse_depth_;
  std::vector<int> instance_;
  std::vector<int> packet_triangle_;  // rows of stride_ / 4
};

}  // namespace diorama
