// What the colour samples near some pixels of a tile may meet: cheaper than traversal where it is
// known how far samples stray from their pixels. Samples start where the camera is at their moment;
// by Pluecker coordinates a triangle's weights change with the start by a product of the ray's
// moment and the triangle's sides alone.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/bvh.h"
#include "sim/render_scene.h"
#include "sim/tile_motion.h"
#include "sim/triangle_tiles.h"

namespace diorama {

// Bit per lane of each packet of a tile.
using RoughPixels = std::array<int, kPacketsPerTile>;

class SampleCandidates;

// Of one pixel.
struct PixelCandidates {
  const SampleCandidates& all;
  size_t lane;
  // The nearest hits of eight of the pixel's samples, without normals.
  PacketHits closest(const RayPacket& rays) const;
};

class SampleCandidates {
 public:
  // All must outlive it. Until candidates are gathered, rays are traced.
  SampleCandidates(const RenderScene& scene, const RayTable& table, const TriangleTiles& tiles)
      : scene_(scene), table_(table), tiles_(tiles) {}

  // For samples of the rough pixels of a tile in which the image moves so far during the exposure.
  void gather(int tile, const TileMotion& motion, const RoughPixels& rough,
              const TruthBuffer& truth);
  // Turns to some pixels of packet p.
  void choose(int p, int lanes);
  PixelCandidates of(int lane) const { return {*this, static_cast<size_t>(lane)}; }

 private:
  friend PixelCandidates;
  static constexpr size_t kMost = 96;  // of one pixel
  static constexpr size_t kBlocks = kTileBlocks * kTileBlocks;

  struct Rays;  // as the triangles need them
  struct alignas(128) Candidate {
    PlacedTriangle placed;
    Vector3f side0, side1, side2;  // opposite the corners, in the sense of the weights; world

    // Proportional to those of the corners where the rays meet the triangle's plane.
    std::array<simd::Float8, 3> weights(const Rays& rays) const;
  };
  struct Nearest;
  struct Touched {
    uint32_t place;  // among the candidates
    int lanes;       // a bit each
  };

  void gatherBlocks(const RoughPixels& rough, Reach reach, const TruthBuffer& truth);
  void sortIn(const PlacedTriangle& triangle);
  Candidate candidate(const PlacedTriangle& triangle) const;
  size_t findTouched(int p, int lanes);
  PacketHits closest(size_t lane, const RayPacket& rays) const;

  const RenderScene& scene_;
  const RayTable& table_;
  const TriangleTiles& tiles_;
  bool gathered_ = false;
  int tile_ = 0;
  float margin_x_ = 0, margin_y_ = 0;  // of directions
  std::array<TileRays::Row, kTileBlocks> rows_;
  std::array<simd::Float8, kTileBlocks> farthest_;  // inverse depth of what blocks show
  std::array<simd::Int8, kTileBlocks> rough_;       // masks of blocks
  std::vector<const PlacedTriangle*> listed_;
  std::vector<Candidate> candidates_;
  std::array<std::vector<uint32_t>, kBlocks> in_block_;
  std::vector<Touched> touched_;    // what samples of the chosen pixels may meet
  std::vector<uint32_t> in_pixel_;  // places of those of each lane, one lane after the other
  size_t per_pixel_ = 0;            // from one lane's first to the next one's
  std::array<size_t, 8> pixel_count_{};
  float chosen_farthest_ = 0;
};

inline PacketHits PixelCandidates::closest(const RayPacket& rays) const {
  return all.closest(lane, rays);
}

}  // namespace diorama
