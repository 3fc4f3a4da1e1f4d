#include "sim/candidate_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace diorama {

CameraTriangle::CameraTriangle(const RenderScene& scene, const SE3& T_camera_world,
                               uint32_t triangle)
    : number_(triangle) {
  const auto corner = [&](int k) -> Vector3d {
    return T_camera_world * scene.corner(triangle, k).cast<double>();
  };
  const Vector3d p0 = corner(0), p1 = corner(1), p2 = corner(2);
  a_ = p1.cross(p2);
  b_ = p2.cross(p0);
  c_ = p0.cross(p1);
  volume_ = p0.dot(a_);
}

// A ray is inside when it lies on the same side of all three planes.
void CameraTriangle::meet(NearestTriangles& rays) const {
  for (size_t i = 0; i < rays.x.size(); ++i) {
    const double a = a_.x() * rays.x[i] + a_.y() * rays.y[i] + a_.z();
    const double b = b_.x() * rays.x[i] + b_.y() * rays.y[i] + b_.z();
    const double c = c_.x() * rays.x[i] + c_.y() * rays.y[i] + c_.z();
    const double depth = volume_ / (a + b + c);
    const bool inside = std::min({a, b, c}) >= 0 || std::max({a, b, c}) <= 0;
    const bool nearer = inside && depth > 0 && depth < rays.depth[i];
    rays.depth[i] = nearer ? depth : rays.depth[i];
    rays.triangle[i] = nearer ? number_ : rays.triangle[i];
  }
}

void CandidateTriangles::addAnother(uint32_t id) {
  if (id == 0 || count_ == kMost) {
    outline_ |= id == 0 || std::find(begin(), end(), id - 1) == end();
    return;
  }
  if (std::find(begin(), end(), id - 1) == end()) triangles_[count_++] = id - 1;
}

namespace {

// Meshes have several vertices at one place where normals or texture coordinates differ.
bool shareEdge(const RenderScene& scene, uint32_t a, uint32_t b) {
  int shared = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) shared += scene.corner(a, i) == scene.corner(b, j);
  return shared >= 2;
}

}  // namespace

bool CandidateTriangles::formOneSurface(const RenderScene& scene) const {
  if (outline_) return false;
  std::array<uint32_t, kMost> joined{triangles_[0]}, rest{};
  size_t joined_count = 1, rest_count = count_ - 1;
  std::copy(begin() + 1, end(), rest.begin());
  for (size_t k = 0; k < joined_count; ++k)
    for (size_t r = 0; r < rest_count;) {
      if (!shareEdge(scene, joined[k], rest[r])) {
        ++r;
        continue;
      }
      joined[joined_count++] = rest[r];
      rest[r] = rest[--rest_count];
    }
  return rest_count == 0;
}

}  // namespace diorama
