// Meshes that stand on, or in, one another.
#pragma once

#include <optional>

#include "core/mesh.h"
#include "core/se3.h"
#include "sim/embree_ray_query.h"

namespace diorama {

// A mesh in its own frame, kept by reference, with what is needed to touch it.
class Solid {
 public:
  explicit Solid(const Mesh& mesh);

  const Mesh& mesh() const { return mesh_; }

  // The first surface along the ray; both in this frame.
  std::optional<RayHit> closestHit(const Vector3d& origin, const Vector3d& direction) const {
    return rays_.closestHit(0, origin, direction);
  }
  // Whether any edge of `other`, made smaller by kTouch_m, passes through this surface.
  bool isCutByEdgesOf(const Solid& other, const SE3& T_this_other) const;
  // Whether a point lies inside: surfaces left along a ray outnumber those entered.
  bool contains(const Vector3d& point) const;

  // Things that stand on one another overlap by as much.
  static constexpr double kTouch_m = 1e-3;
  // A corner of the mesh moved towards the middle of its box, so that the box is smaller by
  // kTouch_m on each side.
  Vector3d innerCorner(size_t index) const;

 private:
  const Mesh& mesh_;
  Vector3d low_, high_;  // of the mesh
  EmbreeRayQuery rays_;
  std::vector<std::vector<uint32_t>> neighbours_;  // per corner, those with higher numbers
};

struct PlacedMesh {
  const Mesh& mesh;
  SE3 T_world_object;
};

// Whether two things share space, deeper than kTouch_m: their oriented boxes meet, and an edge of
// one passes through the other's surface or one is inside the other.
bool overlap(const PlacedMesh& a, const PlacedMesh& b);

// How far `upper` can sink straight down until a corner of one meets the other's surface; nothing
// when it passes beside.
std::optional<double> freeFall_m(const PlacedMesh& upper, const PlacedMesh& lower);

}  // namespace diorama
