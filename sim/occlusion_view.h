// Which rays of the camera see an object when nothing, or an occluder, is put before it.
#pragma once

#include <memory>
#include <vector>

#include "core/camera.h"
#include "core/mesh.h"
#include "sim/bvh.h"
#include "sim/ray_table.h"
#include "sim/scene.h"

namespace diorama {

// Triangles with a ray hierarchy of their own.
class TraceableMesh {
 public:
  void add(const Mesh& mesh, const SE3& T_this_mesh);
  void build();  // once, after the last add
  // True for lanes that hit anything in (t_min, t_max); the rays are given in the world.
  simd::Int8 occluded(const SE3& T_world_this, const RayPacket& rays, simd::Int8 active,
                      simd::Float8 t_max) const;
  simd::Float8 distance(const SE3& T_world_this, const RayPacket& rays, simd::Int8 active) const;
  // Whether the straight line between two points of the world hits anything.
  bool cuts(const SE3& T_world_this, const Vector3d& from, const Vector3d& to) const;

 private:
  std::vector<Vector3f> corners_;
  std::vector<uint32_t> indices_;
  std::unique_ptr<Bvh> bvh_;
};

// One frame: the rays through pixel centres that see the object.
struct ObjectView {
  SE3 T_world_camera;
  int px_all = 0;                  // of the whole silhouette, counted as Silhouette does
  std::vector<RayPacket> visible;  // world
  std::vector<int> lanes;          // how many of each packet count
  int px_visible = 0;
  double fraction() const { return px_all ? static_cast<double>(px_visible) / px_all : 0; }
};

class ObjectViewer {
 public:
  // `meshes` are the scene's objects'. All are kept by reference.
  ObjectViewer(const Scene& scene, size_t object, const std::vector<Mesh>& meshes,
               const Mesh* environment);

  // Without occluders that are not in the scene yet. Thread-safe.
  ObjectView look(int frame) const;
  const Camera& camera() const { return camera_; }
  // The middle of the object's bounding box, in the world.
  Vector3d middle(int frame) const;
  Vector3d middleInObject() const { return (low_ + high_) / 2; }
  double radius_m() const { return (high_ - low_).norm() / 2; }  // about the middle
  // Whether the line between two points meets anything of the scene, the object included.
  bool meetsScene(int frame, const Vector3d& from, const Vector3d& to) const;

 private:
  struct Moving {
    size_t object;
    TraceableMesh mesh;
  };
  void lookAlong(int c, int r, int row, double time_s, ObjectView& view) const;
  const Scene& scene_;
  size_t object_;
  Camera camera_;
  ExtendedGrid grid_;
  Vector3d low_, high_;  // of the object
  TraceableMesh target_, resting_;
  std::vector<Moving> moving_;
};

// How many of a view's rays an occluder leaves open; every `step`-th packet is looked at.
double openFraction(const ObjectView& view, const TraceableMesh& occluder,
                    const SE3& T_world_occluder, size_t step = 1);

}  // namespace diorama
