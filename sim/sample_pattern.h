// Where the colour samples of a pixel lie, in the pixel and in the exposure time.
#pragma once

#include <algorithm>
#include <vector>

#include "core/types.h"
#include "sim/ray_table.h"
#include "sim/renderer.h"
#include "sim/row_cameras.h"
#include "sim/worker_pool.h"

namespace diorama {

struct PixelSample {
  float du = 0, dv = 0;  // from the pixel centre, px
  Vector3f origin;       // of the camera at the sample's moment, world, m
  Vector3f axis_x, axis_y, axis_z;
  float dither =
      0;  // in [0, 1): between two mip levels; the same for samples that mirror each other
};

// Eight samples of one pixel, one a lane.
struct SampleLanes {
  simd::Float8 du, dv;
  simd::Vector8 origin, axis_x, axis_y, axis_z;
  simd::Float8 dither;
};

struct SamplePattern {
  std::vector<PixelSample> taps;                     // of a texture where nothing else changes
  std::vector<PixelSample> base;                     // for other pixels
  std::vector<PixelSample> extra;                    // as many again, where an edge needs them
  std::vector<SampleLanes> base_lanes, extra_lanes;  // the same samples
  float footprint = 1, tap_footprint = 1;            // of one sample and of one tap, px
};

struct PatternOptions {
  int count;        // 8, 16 or 32: each sample has a row, a column and a moment of its own
  float footprint;  // px
  int taps;         // 4, or as many as samples
  float tap_footprint;
};

// The patterns of the two rows of a packet: the same but for the camera's poses.
struct PatternRows {
  const SamplePattern& first;
  const SamplePattern& second;
};

// One sample of each pixel of a packet.
inline RayPacket raysOf(const PacketRays& packet, const PixelSample& s) {
  const simd::Float8 x = simd::load(packet.x) + (s.du * packet.dx_du + s.dv * packet.dx_dv);
  const simd::Float8 y = simd::load(packet.y) + (s.du * packet.dy_du + s.dv * packet.dy_dv);
  return {simd::splat3(s.origin),
          simd::splat3(s.axis_x) * x + simd::splat3(s.axis_y) * y + simd::splat3(s.axis_z)};
}

// Eight samples of the pixel in a lane of the packet.
inline RayPacket raysOf(const PacketRays& packet, size_t lane, const SampleLanes& s) {
  const simd::Float8 x = packet.x[lane] + (s.du * packet.dx_du + s.dv * packet.dx_dv);
  const simd::Float8 y = packet.y[lane] + (s.du * packet.dy_du + s.dv * packet.dy_dv);
  return {s.origin, s.axis_x * x + s.axis_y * y + s.axis_z};
}

// Samples of both rows differ in the camera's pose alone.
inline RayPacket raysOf(const PacketRays& packet, const PixelSample& first,
                        const PixelSample& second) {
  const RayPacket rays = raysOf(packet, first);
  return &first == &second ? rays : joinRows(rays, raysOf(packet, second));
}

// A pattern along the camera's motion: one for all rows, or, with a rolling shutter, one a row.
class MovingPattern {
 public:
  MovingPattern() = default;
  MovingPattern(const PatternOptions& options, const ExposureMotion& motion, int height,
                WorkerPool& pool);

  // Of the packet whose first row is y.
  PatternRows rows(int y) const { return {(*this)[y], (*this)[y + 1]}; }
  // Of a sample's start from a point, m.
  double farthest(const Vector3d& from) const;
  const SamplePattern& operator[](int y) const {
    return by_row_[std::min(static_cast<size_t>(y), by_row_.size() - 1)];
  }

 private:
  std::vector<SamplePattern> by_row_;
};

}  // namespace diorama
