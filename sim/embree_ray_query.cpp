#include "sim/embree_ray_query.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/errors.h"
#include "sim/bvh.h"

namespace diorama {

using simd::Float8;
using simd::Int8;

namespace {

std::vector<Vector3f> withSpare(std::vector<Vector3f> positions) {
  positions.emplace_back(Vector3f::Zero());  // Embree reads past the last corner
  return positions;
}

std::vector<uint32_t> flatten(const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<uint32_t> indices;
  indices.reserve(3 * triangles.size());
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) indices.push_back(static_cast<uint32_t>(t[k]));
  return indices;
}

}  // namespace

struct EmbreeRayQuery::Object {
  explicit Object(const Mesh& mesh)
      : corners(withSpare(mesh.positions)),
        indices(flatten(mesh.triangles)),
        bvh(std::span(corners).first(mesh.positions.size()), indices) {}
  std::vector<Vector3f> corners;
  std::vector<uint32_t> indices;
  Bvh bvh;
};

EmbreeRayQuery::EmbreeRayQuery(std::span<const Mesh> meshes) {
  for (const Mesh& mesh : meshes) objects_.push_back(std::make_unique<const Object>(mesh));
}

EmbreeRayQuery::~EmbreeRayQuery() = default;

void EmbreeRayQuery::occluded(int object, const Vector3d& origin, std::span<const Vector3d> points,
                              std::span<uint8_t> occluded) const {
  DIORAMA_CHECK(points.size() == occluded.size());
  const Bvh& bvh = objects_.at(static_cast<size_t>(object))->bvh;
  constexpr float kBeforePoint = 0.999f;  // the point itself lies on a surface
  RayPacket rays{simd::splat3(origin), simd::splat3(0, 0, 1)};
  for (size_t first = 0; first < points.size(); first += 8) {
    const int count = static_cast<int>(std::min<size_t>(8, points.size() - first));
    for (int i = 0; i < count; ++i) {
      const Vector3d d = points[first + static_cast<size_t>(i)] - origin;
      rays.direction.x[i] = static_cast<float>(d.x());
      rays.direction.y[i] = static_cast<float>(d.y());
      rays.direction.z[i] = static_cast<float>(d.z());
    }
    const Int8 hit = bvh.occluded(rays, simd::firstLanes(count), simd::splat(0.f),
                                  simd::splat(kBeforePoint), true);
    for (int i = 0; i < count; ++i) occluded[first + static_cast<size_t>(i)] = hit[i] ? 1 : 0;
  }
}

std::optional<RayHit> EmbreeRayQuery::closestHit(int object, const Vector3d& origin,
                                                 const Vector3d& direction) const {
  const Object& target = *objects_.at(static_cast<size_t>(object));
  const RayPacket rays{simd::splat3(origin), simd::splat3(direction)};
  const PacketHits hits = target.bvh.closest(rays, simd::firstLanes(1), simd::splat(0.f), true);
  if (!hits.mask[0]) return std::nullopt;
  const uint32_t* corner = target.indices.data() + 3 * static_cast<size_t>(hits.triangle[0]);
  const Vector3d p0 = target.corners[corner[0]].cast<double>(),
                 p1 = target.corners[corner[1]].cast<double>(),
                 p2 = target.corners[corner[2]].cast<double>();
  RayHit hit;
  hit.normal = (p1 - p0).cross(p2 - p0).normalized();
  // Onto the triangle's plane, in double precision.
  const double along = hit.normal.dot(direction);
  hit.p_object = std::abs(along) > 1e-12 * direction.norm()
                     ? Vector3d(origin + direction * (hit.normal.dot(p0 - origin) / along))
                     : Vector3d(p0 + static_cast<double>(hits.u[0]) * (p1 - p0) +
                                static_cast<double>(hits.v[0]) * (p2 - p0));
  return hit;
}

}  // namespace diorama
