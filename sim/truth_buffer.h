// Depth, instance id and patch (sim/patches.h) at pixel centres while a frame is being drawn.
#pragma once

#include <vector>

#include "sim/renderer.h"
#include "sim/simd.h"

namespace diorama {

// How far around a pixel to look, px.
struct Reach {
  int x, y;
};

// Rows are padded to whole tiles; threads write disjoint packets.
class TruthBuffer {
 public:
  TruthBuffer(int padded_width, int padded_height);

  // What a packet's pixels show instead of a patch where that is no help.
  static constexpr int kNothing = 0, kUnknown = -1;

  // A packet of two rows of four pixels, the first row in lanes 0-3. Patches are unknown where
  // there is no ray, or where things move by themselves.
  void put(int x, int y, simd::Float8 depth_m, simd::Int8 instance, simd::Int8 patch);

  float depth(int x, int y) const { return depth_[at(x, y)]; }  // 0 = nothing hit
  int instance(int x, int y) const { return instance_[at(x, y)]; }

  // Whether an outline or crease passes the 4 x 2 pixels at (x, y) or their neighbours: instances
  // differ, or inverse depth, which is linear in the image of a plane, bends.
  bool hasEdge(int x, int y, int width, int height) const;

  // Bit per lane of the packet at (x, y): whether the pixels up to `reach` from it show more than
  // one patch, or one that is bent.
  int roughPixels(int x, int y, Reach reach, int width, int height) const;

  // Of the pixels of a block at (x, y) and those up to `reach` around it: 0 where one hits nothing.
  float leastInverseDepth(int x, int y, Reach reach) const;

  void copyTo(RenderedFrame& frame, int width, int height) const;

 private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(stride_) + static_cast<size_t>(x);
  }
  template <class Visit>
  void visitPackets(int x, int y, int height, Reach reach, const Visit& visit) const;
  bool isEven(int x, int y, Reach reach) const;
  bool isMixed(int x, int y, Reach reach, int width, int height) const;
  int mixedPixels(int x, int y, Reach reach) const;
  int bentPixels(int x, int y, Reach reach) const;

  int stride_, rows_;
  std::vector<float> depth_, inverse_depth_;
  std::vector<int> instance_, patch_;
  // Of each packet, in rows of stride_ / 4:
  std::vector<int> packets_;             // the patch of all pixels, or kUnknown
  std::vector<float> packets_farthest_;  // their least inverse depth
};

}  // namespace diorama
