#include "tracker/surface_points.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace diorama {
namespace {

// A corner, and the sides that start there.
std::array<Vector3d, 3> sidesOf(const Mesh& mesh, size_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Vector3d a = mesh.positions[static_cast<size_t>(t[0])].cast<double>();
  const Vector3d b = mesh.positions[static_cast<size_t>(t[1])].cast<double>();
  const Vector3d c = mesh.positions[static_cast<size_t>(t[2])].cast<double>();
  return {a, b - a, c - a};
}

}  // namespace

std::vector<SurfacePoint> scatterPoints(const Mesh& mesh, const std::vector<size_t>& triangles,
                                        int count) {
  double area = 0;
  for (const size_t t : triangles) {
    const auto [a, ab, ac] = sidesOf(mesh, t);
    area += ab.cross(ac).norm() / 2;
  }
  const double step = area / count;
  std::vector<SurfacePoint> points;
  if (!(step > 0)) return points;
  double passed = 0, next = step / 2;
  for (const size_t t : triangles) {
    const auto [a, ab, ac] = sidesOf(mesh, t);
    const Vector3d n = ab.cross(ac);
    for (passed += n.norm() / 2; next < passed; next += step) {
      const double k = static_cast<double>(points.size());
      double u = std::fmod(k * (std::numbers::phi - 1), 1), v = std::fmod(k * 0.7548776662, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      points.push_back({a + u * ab + v * ac, n.normalized(), t});
    }
  }
  return points;
}

std::vector<SurfacePoint> scatterPoints(const Mesh& mesh, int count) {
  std::vector<size_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), size_t{0});
  return scatterPoints(mesh, all, count);
}

}  // namespace diorama
