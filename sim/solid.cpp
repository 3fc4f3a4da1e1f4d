#include "sim/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace diorama {
namespace {

struct OrientedBox {
  Vector3d center, half;
  Matrix3d axes;
};

OrientedBox boxOf(const PlacedMesh& placed) {
  const Vector3d low = placed.mesh.minCorner().cast<double>(),
                 high = placed.mesh.maxCorner().cast<double>();
  const Vector3d half = (high - low) / 2 - Vector3d::Constant(Solid::kTouch_m / 2);
  return {placed.T_world_object * Vector3d((low + high) / 2), half.cwiseMax(0),
          placed.T_world_object.rotationMatrix()};
}

// Separating axes: the boxes' own and the cross products of them (S. Gottschalk et al., OBBTree,
// SIGGRAPH 1996).
bool boxesMeet(const OrientedBox& a, const OrientedBox& b) {
  const auto apart = [&](const Vector3d& axis) {
    const double reach = (a.axes.transpose() * axis).cwiseAbs().dot(a.half) +
                         (b.axes.transpose() * axis).cwiseAbs().dot(b.half);
    return std::abs(axis.dot(b.center - a.center)) > reach;
  };
  for (int i = 0; i < 3; ++i) {
    if (apart(a.axes.col(i)) || apart(b.axes.col(i))) return false;
    for (int j = 0; j < 3; ++j) {
      const Vector3d axis = a.axes.col(i).cross(b.axes.col(j));
      if (axis.norm() > 1e-6 && apart(axis)) return false;
    }
  }
  return true;
}

}  // namespace

Solid::Solid(const Mesh& mesh)
    : mesh_(mesh),
      low_(mesh.minCorner().cast<double>()),
      high_(mesh.maxCorner().cast<double>()),
      rays_(std::span(&mesh, 1)) {
  std::vector<std::pair<int, int>> edges;
  for (const Eigen::Vector3i& t : mesh_.triangles)
    for (int k = 0; k < 3; ++k) edges.push_back(std::minmax({t[k], t[(k + 1) % 3]}));
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  neighbours_.resize(mesh_.positions.size());
  for (const auto& [a, b] : edges)
    neighbours_[static_cast<size_t>(a)].push_back(static_cast<uint32_t>(b));
}

Vector3d Solid::innerCorner(size_t index) const {
  const Vector3d center = (low_ + high_) / 2, half = (high_ - low_) / 2;
  const Vector3d scale = (1 - kTouch_m / half.array().max(2 * kTouch_m)).matrix();
  return center + scale.cwiseProduct(mesh_.positions[index].cast<double>() - center);
}

bool Solid::isCutByEdgesOf(const Solid& other, const SE3& T_this_other) const {
  std::vector<Vector3d> ends;
  std::vector<uint8_t> hit;
  for (size_t i = 0; i < other.neighbours_.size(); ++i) {
    const Vector3d start = T_this_other * other.innerCorner(i);
    ends.clear();
    for (uint32_t j : other.neighbours_[i]) {
      const Vector3d end = T_this_other * other.innerCorner(j);
      const bool near = (start.cwiseMin(end).array() <= high_.array()).all() &&
                        (start.cwiseMax(end).array() >= low_.array()).all();
      if (near) ends.push_back(end);
    }
    if (ends.empty()) continue;
    hit.assign(ends.size(), 0);
    rays_.occluded(0, start, ends, hit);
    if (std::find(hit.begin(), hit.end(), 1) != hit.end()) return true;
  }
  return false;
}

bool Solid::contains(const Vector3d& point) const {
  constexpr int kMaxSurfaces = 200;
  constexpr double kStep_m = 1e-6;
  const Vector3d direction = Vector3d(0.137, 0.211, 0.968).normalized();  // along no wall
  Vector3d origin = point;
  int left = 0;
  for (int k = 0; k < kMaxSurfaces; ++k) {
    const std::optional<RayHit> hit = closestHit(origin, direction);
    if (!hit) break;
    left += hit->normal.dot(direction) > 0 ? 1 : -1;
    origin = hit->p_object + kStep_m * direction;
  }
  return left > 0;
}

bool overlap(const PlacedMesh& a, const PlacedMesh& b) {
  if (!boxesMeet(boxOf(a), boxOf(b))) return false;
  const Solid solid_a(a.mesh), solid_b(b.mesh);
  const SE3 T_a_b = a.T_world_object.inverse() * b.T_world_object;
  return solid_a.isCutByEdgesOf(solid_b, T_a_b) ||
         solid_b.isCutByEdgesOf(solid_a, T_a_b.inverse()) ||
         solid_a.contains(T_a_b * solid_b.innerCorner(0)) ||
         solid_b.contains(T_a_b.inverse() * solid_a.innerCorner(0));
}

std::optional<double> freeFall_m(const PlacedMesh& upper, const PlacedMesh& lower) {
  double least = std::numeric_limits<double>::infinity();
  const auto cast = [&](const PlacedMesh& from, const PlacedMesh& to, const Vector3d& direction) {
    const Solid target(to.mesh);
    const SE3 T_to_from = to.T_world_object.inverse() * from.T_world_object;
    const Vector3d along = to.T_world_object.rotation.conjugate() * direction;
    for (const Vector3f& corner : from.mesh.positions) {
      const Vector3d origin = T_to_from * corner.cast<double>();
      if (const auto hit = target.closestHit(origin, along))
        least = std::min(least, (hit->p_object - origin).norm());
    }
  };
  cast(upper, lower, -Vector3d::UnitZ());
  cast(lower, upper, Vector3d::UnitZ());
  if (std::isinf(least)) return std::nullopt;
  return least;
}

}  // namespace diorama
