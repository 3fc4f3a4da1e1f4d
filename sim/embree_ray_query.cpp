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

void setDirection(RayPacket& rays, int lane, const Vector3d& d) {
  rays.direction.x[lane] = static_cast<float>(d.x());
  rays.direction.y[lane] = static_cast<float>(d.y());
  rays.direction.z[lane] = static_cast<float>(d.z());
}

}  // namespace

struct EmbreeRayQuery::Object {
  explicit Object(const Mesh& mesh)
      : corners(withSpare(mesh.positions)),
        indices(flatten(mesh.triangles)),
        bvh(std::span(corners).first(mesh.positions.size()), indices) {}
  RayHit hit(const Vector3d& origin, const Vector3d& direction, const PacketHits& hits,
             int lane) const;
  std::vector<Vector3f> corners;
  std::vector<uint32_t> indices;
  Bvh bvh;
};

RayHit EmbreeRayQuery::Object::hit(const Vector3d& origin, const Vector3d& direction,
                                   const PacketHits& hits, int lane) const {
  const uint32_t* corner = indices.data() + 3 * static_cast<size_t>(hits.triangle[lane]);
  const Vector3d p0 = corners[corner[0]].cast<double>(), p1 = corners[corner[1]].cast<double>(),
                 p2 = corners[corner[2]].cast<double>();
  RayHit hit;
  hit.triangle = hits.triangle[lane];
  hit.normal = (p1 - p0).cross(p2 - p0).normalized();
  // Onto the triangle's plane, in double precision.
  const double along = hit.normal.dot(direction);
  hit.p_object = std::abs(along) > 1e-12 * direction.norm()
                     ? Vector3d(origin + direction * (hit.normal.dot(p0 - origin) / along))
                     : Vector3d(p0 + static_cast<double>(hits.u[lane]) * (p1 - p0) +
                                static_cast<double>(hits.v[lane]) * (p2 - p0));
  return hit;
}

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
    for (int i = 0; i < count; ++i)
      setDirection(rays, i, points[first + static_cast<size_t>(i)] - origin);
    const Int8 hit = bvh.occluded(rays, simd::firstLanes(count), simd::splat(0.f),
                                  simd::splat(kBeforePoint), true);
    for (int i = 0; i < count; ++i) occluded[first + static_cast<size_t>(i)] = hit[i] ? 1 : 0;
  }
}

std::optional<RayHit> EmbreeRayQuery::closestHit(int object, const Vector3d& origin,
                                                 const Vector3d& direction) const {
  return closestHits(object, origin, {&direction, 1}).front();
}

std::vector<std::optional<RayHit>> EmbreeRayQuery::closestHits(
    int object, const Vector3d& origin, std::span<const Vector3d> directions) const {
  const Object& target = *objects_.at(static_cast<size_t>(object));
  std::vector<std::optional<RayHit>> found(directions.size());
  RayPacket rays{simd::splat3(origin), simd::splat3(0, 0, 1)};
  for (size_t first = 0; first < directions.size(); first += 8) {
    const int count = static_cast<int>(std::min<size_t>(8, directions.size() - first));
    for (int i = 0; i < count; ++i)
      setDirection(rays, i, directions[first + static_cast<size_t>(i)]);
    const PacketHits hits =
        target.bvh.closest(rays, simd::firstLanes(count), simd::splat(0.f), true);
    for (int i = 0; i < count; ++i)
      if (hits.mask[i]) {
        const size_t k = first + static_cast<size_t>(i);
        found[k] = target.hit(origin, directions[k], hits, i);
      }
  }
  return found;
}

}  // namespace diorama
