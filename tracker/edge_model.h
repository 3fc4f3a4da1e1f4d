// The edges of a mesh that can show in an image, and points on them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/mesh_edges.h"
#include "core/se3.h"
#include "tracker/tracker_options.h"

namespace diorama {

struct ModelEdge : MeshEdge {
  int first_sample = 0, sample_count = 0;
};

struct EdgeSample {
  Vector3d p;          // m, model frame
  Vector3d direction;  // unit, along the edge
  int edge = 0;
};

// The planes of the two faces of every edge, for passing over all of them quickly.
struct FacePlanes {
  std::vector<float> nx, ny, nz, d;  // n . p = d, model frame
  void add(const Vector3d& normal, const Vector3d& p);
};

// Coordinates are in the *model frame*: the object frame moved to the centre of its bounding box,
// so that rotation and translation of a pose are nearly independent.
struct EdgeModel {
  Vector3d centre_object = Vector3d::Zero();  // origin of the model frame, m, in the object frame
  double diameter = 0;                        // m, diagonal of the bounding box
  double sample_spacing = 0;                  // m
  std::vector<Vector3d> vertices;             // welded
  std::vector<Vector3d> outermost;            // vertices that span its silhouette from any side
  std::vector<ModelEdge> edges;
  FacePlanes first_planes, second_planes;        // of n1 and n2 of the edges
  std::vector<int> boundary_edges, sharp_edges;  // places in `edges`
  std::vector<EdgeSample> samples;               // those of one edge follow one another
};

// contour[i] = 1 when edge i is on the outline, or on an open rim, seen from `eye`, else 0.
void findContour(const EdgeModel& model, const Vector3d& eye, std::vector<uint8_t>& contour);

// From the edges of core/mesh_edges.h. No edges when the mesh has no face.
EdgeModel makeEdgeModel(const Mesh& mesh, const TrackerOptions& options);

// The smallest box around the projection of the model, px. Empty (low > high) behind the camera.
struct ProjectedBox {
  Vector2d low, high;
};
ProjectedBox projectedBox(const EdgeModel& model, const Camera& camera, const SE3& T_camera_model);

// About how far the projection moves between two poses T_camera_model, px.
double pixelMotion(const EdgeModel& model, const Camera& camera, const SE3& a, const SE3& b);

}  // namespace diorama
