// A bounding-volume hierarchy over triangles, traversed by packets of eight rays (Embree 3).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "core/types.h"
#include "sim/simd.h"

namespace diorama {

struct RayPacket {
  simd::Vector8 origin;     // m
  simd::Vector8 direction;  // not normalised; distances count in its length
};

struct PacketHits {
  simd::Float8 t;     // along the direction; infinite where nothing is hit
  simd::Float8 u, v;  // barycentric: p = (1 - u - v) p0 + u p1 + v p2
  simd::Vector8
      normal;  // (p1 - p0) x (p2 - p0): outwards for counter-clockwise triangles, any length
  simd::Int8 triangle;  // 0 where nothing is hit
  simd::Int8 mask;      // lanes that hit something
};

enum class Traversal {
  kWatertight,  // no ray slips between two triangles
  kQuick        // a quarter less time; one ray in some millions may slip through
};

// Calls are const and thread-safe. Packets whose rays run nearly alike should be marked coherent.
class Bvh {
 public:
  // Corners and index triples stay referenced: they must outlive the hierarchy. The corners'
  // storage must have one spare element behind its end (Embree reads 16 bytes of the last one).
  Bvh(std::span<const Vector3f> corners, std::span<const uint32_t> indices,
      Traversal traversal = Traversal::kWatertight);
  ~Bvh();
  Bvh(Bvh&&) noexcept;
  Bvh& operator=(Bvh&&) noexcept;

  PacketHits closest(const RayPacket& rays, simd::Int8 active, simd::Float8 t_min,
                     bool coherent) const;
  // Two packets whose rays run nearly alike, in a fraction of the time of two calls where the
  // processor takes sixteen rays at once.
  std::array<PacketHits, 2> closestOfPair(const std::array<RayPacket, 2>& rays,
                                          const std::array<simd::Int8, 2>& active) const;
  // Mask of the active lanes that hit anything in (t_min, t_max).
  simd::Int8 occluded(const RayPacket& rays, simd::Int8 active, simd::Float8 t_min,
                      simd::Float8 t_max, bool coherent) const;

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
};

}  // namespace diorama
