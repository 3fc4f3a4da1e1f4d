// Visibility rays against a list of meshes, by Embree.
#pragma once

#include <memory>
#include <span>

#include "core/mesh.h"
#include "core/ray_query.h"

namespace diorama {

// Objects are numbered as the meshes are; a mesh may be forgotten after construction.
// Single precision: lengths of about 1 m are right to about 1e-6 m.
class EmbreeRayQuery : public RayQuery {
 public:
  explicit EmbreeRayQuery(std::span<const Mesh> meshes);
  ~EmbreeRayQuery() override;

  void occluded(int object, const Vector3d& origin, std::span<const Vector3d> points,
                std::span<uint8_t> occluded) const override;
  std::optional<RayHit> closestHit(int object, const Vector3d& origin,
                                   const Vector3d& direction) const override;
  std::vector<std::optional<RayHit>> closestHits(
      int object, const Vector3d& origin, std::span<const Vector3d> directions) const override;

 private:
  struct Object;
  std::vector<std::unique_ptr<const Object>> objects_;
};

}  // namespace diorama
