// What the textures of a model say is printed on it: patches whose place on the object is known
// exactly, unlike those of keyframes, whose poses were estimated.
#pragma once

#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/mesh.h"
#include "core/ray_query.h"
#include "core/se3.h"
#include "tracker/patch.h"

namespace diorama {

class Print {
 public:
  // The mesh is in the object frame, poses are of the model frame, which lies at centre_object.
  // Textures that cannot be read count as none: a tracker can do without. All references must
  // outlive this object.
  Print(const Mesh& mesh, const Vector3d& centre_object, const Camera& camera, const RayQuery& rays,
        int object);

  bool empty() const { return points_.empty(); }

  // Whether a triangle of the mesh has a texture, and whether all have.
  bool isKnown(int triangle) const;
  bool isComplete() const { return complete_; }

  // Patches of the size of this camera's pixels, where the print tells them from their
  // surroundings; the best ones, well apart.
  std::vector<Patch> patchesSeenFrom(const SE3& T_camera_model, int most) const;

 private:
  // Light of a texture and its copies of half the size: pixels mix light, not grey values.
  using Levels = std::vector<Image<uint16_t>>;
  // Where a triangle lies in its texture: texels of level 0 are offset + slope p.
  struct Layout {
    int texture = -1;
    Eigen::Matrix<double, 2, 3> slope;
    Vector2d offset;
    Vector2d at(const Vector3d& p_object) const { return slope * p_object + offset; }
    double texelsPerPixel(const Patch& patch) const;
  };
  // Texels of level 0 by which what a patch shows lies elsewhere than on its plane, as the surface
  // is curved: x i + y j + xx i^2 + yy j^2 + xy i j at its pixel (i, j). Where a round label is
  // seen from the side, all of a patch lies nearer to the middle than its plane does.
  struct Bend {
    Vector2d x, y, xx, yy, xy;
  };
  struct Point {
    Vector3d p, normal;  // m, unit, model frame
    size_t triangle;
    float contrast = 0;  // levels
  };

  void layOut(const Mesh& mesh);
  float contrastAround(const Point& point) const;
  bool read(size_t triangle, const Patch& patch, const Bend& bend, Patch::Window& window) const;
  std::optional<Bend> bendAround(const Vector3d& eye_model, const Point& point,
                                 const Patch& patch) const;

  const Vector3d centre_object_;
  const Camera& camera_;
  const RayQuery& rays_;
  const int object_;
  std::vector<Levels> textures_;
  std::vector<Layout> layouts_;  // one per triangle
  std::vector<Point> points_;    // where something is printed, the strongest contrast first
  bool complete_ = false;
};

}  // namespace diorama
