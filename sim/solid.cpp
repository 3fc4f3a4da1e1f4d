#include "sim/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

namespace diorama {
namespace {

struct OrientedBox {
  Vector3d center, half;
  Matrix3d axes;
};

OrientedBox boxOf(const PlacedSolid& placed) {
  const Vector3d low = placed.solid.minCorner(), high = placed.solid.maxCorner();
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

Solid::Solid(Mesh mesh) : mesh_(std::move(mesh)), rays_(std::span(&mesh_, 1)) {
  std::set<std::pair<int, int>> edges;
  for (const Eigen::Vector3i& t : mesh_.triangles)
    for (int k = 0; k < 3; ++k)
      edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  neighbours_.resize(mesh_.positions.size());
  for (const auto& [a, b] : edges)
    neighbours_[static_cast<size_t>(a)].push_back(static_cast<uint32_t>(b));
}

Vector3d Solid::innerCorner(size_t index) const {
  const Vector3d center = (minCorner() + maxCorner()) / 2, half = (maxCorner() - minCorner()) / 2;
  const Vector3d scale = (1 - kTouch_m / half.array().max(2 * kTouch_m)).matrix();
  return center + scale.cwiseProduct(mesh_.positions[index].cast<double>() - center);
}

bool Solid::isCutByEdgesOf(const Solid& other, const SE3& T_this_other) const {
  const Vector3d low = minCorner(), high = maxCorner();
  std::vector<Vector3d> ends;
  std::vector<uint8_t> hit;
  for (size_t i = 0; i < other.neighbours_.size(); ++i) {
    const Vector3d start = T_this_other * other.innerCorner(i);
    ends.clear();
    for (uint32_t j : other.neighbours_[i]) {
      const Vector3d end = T_this_other * other.innerCorner(j);
      const bool near = (start.cwiseMin(end).array() <= high.array()).all() &&
                        (start.cwiseMax(end).array() >= low.array()).all();
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

bool overlap(const PlacedSolid& a, const PlacedSolid& b) {
  if (!boxesMeet(boxOf(a), boxOf(b))) return false;
  const SE3 T_a_b = a.T_world_object.inverse() * b.T_world_object;
  return a.solid.isCutByEdgesOf(b.solid, T_a_b) ||
         b.solid.isCutByEdgesOf(a.solid, T_a_b.inverse()) ||
         a.solid.contains(T_a_b * b.solid.innerCorner(0)) ||
         b.solid.contains(T_a_b.inverse() * a.solid.innerCorner(0));
}

std::optional<double> freeFall_m(const PlacedSolid& upper, const PlacedSolid& lower) {
  double least = std::numeric_limits<double>::infinity();
  const auto cast = [&](const PlacedSolid& from, const PlacedSolid& to, const Vector3d& direction) {
    const SE3 T_to_from = to.T_world_object.inverse() * from.T_world_object;
    const Vector3d along = to.T_world_object.rotation.conjugate() * direction;
    for (const Vector3f& corner : from.solid.mesh().positions) {
      const Vector3d origin = T_to_from * corner.cast<double>();
      if (const auto hit = to.solid.closestHit(origin, along))
        least = std::min(least, (hit->p_object - origin).norm());
    }
  };
  cast(upper, lower, -Vector3d::UnitZ());
  cast(lower, upper, Vector3d::UnitZ());
  if (std::isinf(least)) return std::nullopt;
  return least;
}

}  // namespace diorama
