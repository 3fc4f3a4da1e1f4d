// The triangles that a few neighbouring pixels show, and the rays of a camera against them in
// double precision.
#pragma once

#include <array>
#include <limits>

#include "core/se3.h"
#include "sim/render_scene.h"

namespace diorama {

// Eight rays of directions (x, y, 1), so that distances are depths, and the nearest triangles that
// they have met so far.
struct NearestTriangles {
  std::array<double, 8> x{}, y{}, depth;
  std::array<double, 8> triangle;  // -1: none; a double, so that all lanes have one width
  NearestTriangles() {
    depth.fill(std::numeric_limits<double>::infinity());
    triangle.fill(-1);
  }
};

// A triangle in the camera's frame.
class CameraTriangle {
 public:
  CameraTriangle(const RenderScene& scene, const SE3& T_camera_world, uint32_t triangle);

  // Takes the triangle's hits where they are nearer.
  void meet(NearestTriangles& rays) const;

 private:
  Vector3d a_, b_, c_;  // normals of the planes through the camera's centre and an edge
  double volume_;
  double number_;
};

class CandidateTriangles {
 public:
  static constexpr size_t kMost = 8;

  // An id as TriangleRaster writes it: a triangle's number + 1, or 0 for nothing.
  void add(uint32_t id) {
    if (id == last_) return;
    last_ = id;
    addAnother(id);
  }

  // Whether each of them is joined to the others by common edges, nothing lies between them, and
  // they are few. Where they are not, an outline passes, and what stands foremost there may be
  // narrower than the pixels that were looked at.
  bool formOneSurface(const RenderScene& scene) const;

  // Those that form a surface.
  const uint32_t* begin() const { return triangles_.data(); }
  const uint32_t* end() const { return triangles_.data() + count_; }

 private:
  void addAnother(uint32_t id);
  uint32_t last_ = UINT32_MAX;
  size_t count_ = 0;
  bool outline_ = false;  // nothing is seen beside something, or more than are listed
  std::array<uint32_t, kMost> triangles_{};
};

}  // namespace diorama
