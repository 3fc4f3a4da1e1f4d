// Some triangles of a scene that follow one another, and where in the image a camera sees them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "sim/placed_triangle.h"
#include "sim/plane_depth.h"
#include "sim/render_scene.h"

namespace diorama {

struct TrianglePart {
  uint32_t first_triangle = 0, triangle_count = 0;
  uint32_t first_corner = 0, corner_count = 0;
  Eigen::AlignedBox3d box;  // world
  std::vector<int> closed;  // the closed surfaces of its triangles

  // Of a camera, filled by its owner.
  struct Entry {
    uint32_t tile, placed;
  };
  std::vector<ImagedCorner> corners;
  std::vector<PlacedTriangle> placed;
  std::vector<CameraPlane> planes;  // of the placed ones
  std::vector<Entry> found;
  std::vector<uint32_t> begin;    // of each tile in `entries`
  std::vector<uint32_t> entries;  // places in `placed`

  void clear();
  // `entries` from `found`.
  void sortEntries(size_t tiles);

  // Which of eight triangles, of the part's `first` and the next ones, show their backs to all that
  // is within `reach_m` of a point and belong to closed surfaces: bit per lane.
  unsigned turnedAway(uint32_t first, const Vector3f& from, float reach_m) const;

  // All triangles of a scene; each part belongs to one instance.
  static std::vector<TrianglePart> of(const RenderScene& scene);

 private:
  void setPlanes(const RenderScene& scene);
  // World planes of its triangles: normal . p - distance is positive in front of them. Where backs
  // may be seen the normal is 0 and the distance -1.
  std::vector<float> normal_x_, normal_y_, normal_z_, distance_;
};

}  // namespace diorama
