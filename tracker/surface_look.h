// What an object's surface has looked like so far, and where something else is seen now: an
// unknown thing in front of it, whose edges are not the object's.
#pragma once

#include <vector>

#include "core/camera.h"
#include "core/mesh.h"
#include "core/ray_query.h"
#include "core/se3.h"
#include "tracker/edge_profile.h"
#include "tracker/tracker_options.h"

namespace diorama {

// Which parts of an image do not look like the object: cells over its projected box.
class CoverMap {
 public:
  // Nothing is covered.
  CoverMap() = default;
  CoverMap(const Vector2d& low_px, const Vector2d& high_px);

  void add(const Vector2d& u_px, bool like_before);
  // Whether most of the points around, of those that are known, do not look as before: so many of
  // them that a pose that is off by some pixels does not explain it.
  bool isCovered(const Vector2d& u_px) const;
  // Whether most of what is known looks otherwise in any of the cells.
  bool any() const;
  // Whether that is so anywhere in a square around.
  bool touches(const Vector2d& u_px, double reach_px) const;

 private:
  static constexpr int kCells = 12;  // along the longer side
  static constexpr int kFewestKnown = 3;
  struct Cell {
    int known = 0, changed = 0;
    bool isCovered() const { return known >= kFewestKnown && 2 * changed > known; }
  };
  Vector2d low_px_ = Vector2d::Zero();
  double cell_px_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<Cell> cells_;
};

class SurfaceLook {
 public:
  // The mesh is in the object frame, poses are of the model frame, which lies at centre_object. All
  // references must outlive this object.
  SurfaceLook(const Mesh& mesh, const Vector3d& centre_object, const Camera& camera,
              const RayQuery& rays, int object, const TrackerOptions& options);

  // What is seen of the surface from a pose.
  struct Sight {
    size_t point;
    Vector2d u_px;
    Vector3f value;  // levels
  };
  std::vector<Sight> look(const EdgePicture& picture, const SE3& T_camera_model) const;

  // Compares what is seen with what was learned. Nothing learned, nothing covered.
  CoverMap compare(const std::vector<Sight>& sights) const;

  // Learns from a pose that is right, where nothing covers it.
  void learn(const std::vector<Sight>& sights, const CoverMap& cover);

 private:
  struct Point {
    Vector3d p, normal;                 // m, model frame
    Vector3f value = Vector3f::Zero();  // levels, under the light of the first frame
    float spread = 0;                   // levels, mean absolute difference
    bool known = false;
    int changed_for = 0;  // learned frames in a row
  };
  static float differenceOf(const Vector3f& value, const Point& point);
  float toleranceOf(const Point& point) const;
  float brightness(const std::vector<Sight>& sights) const;

  const Vector3d centre_object_;
  const Camera& camera_;
  const RayQuery& rays_;
  const int object_;
  const TrackerOptions& options_;
  const float tolerance_;
  std::vector<Point> points_;
  bool learned_ = false;
  float brightness_ = 1;  // of the light, against that of the first frame
};

}  // namespace diorama
