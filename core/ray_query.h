// Visibility for estimators: rays against the meshes of tracked objects, never against the scene.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/types.h"

namespace diorama {

struct RayHit {
  Vector3d p_object;  // m
  Vector3d normal;    // unit, of the triangle, as its winding has it
  int triangle = -1;   // its index in the mesh; -1 = not told
};

// Objects are numbered in the order in which their meshes were given. All coordinates are in that
// object's frame, metres: poses are the caller's business. Calls are const and thread-safe.
class RayQuery {
 public:
  virtual ~RayQuery() = default;

  // occluded[i] = 1 when a surface of the object lies between the origin and points[i], else 0. A
  // surface within 0.1% of the distance before the point does not count: the point may lie on it.
  virtual void occluded(int object, const Vector3d& origin, std::span<const Vector3d> points,
                        std::span<uint8_t> occluded) const = 0;

  // The first surface along origin + t * direction, t > 0.
  virtual std::optional<RayHit> closestHit(int object, const Vector3d& origin,
                                           const Vector3d& direction) const = 0;

  // The same for many directions from one origin; quicker where these run nearly alike.
  virtual std::vector<std::optional<RayHit>> closestHits(
      int object, const Vector3d& origin, std::span<const Vector3d> directions) const {
    std::vector<std::optional<RayHit>> hits;
    for (const Vector3d& direction : directions)
      hits.push_back(closestHit(object, origin, direction));
    return hits;
  }
};

}  // namespace diorama
