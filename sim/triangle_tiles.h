// What the rays through the pixel centres of one camera meet: the triangles are sorted into the
// tiles that they may touch, and tested there with each pixel's own ray. In the plane of the ray
// directions (x, y, 1) edges stay straight whatever the lens does, and triangles that reach behind
// the camera need no clipping (M. Olano, T. Greer, Triangle Scan Conversion using 2D Homogeneous
// Coordinates, 1997).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "sim/bvh.h"
#include "sim/ray_table.h"
#include "sim/render_scene.h"
#include "sim/row_cameras.h"
#include "sim/tile_rays.h"
#include "sim/worker_pool.h"

namespace diorama {

using TileHits = std::array<PacketHits, kPacketsPerTile>;

class TriangleTiles {
 public:
  // Scene and table must outlive it. Tiles hold the triangles up to `margin_px` around them.
  TriangleTiles(const RenderScene& scene, const RayTable& table, float margin_px = 0);
  ~TriangleTiles();

  // Sorts the triangles for a camera and for rays that start up to `reach_m` from it.
  void sort(const CameraFrame& camera, WorkerPool& pool, double reach_m = 0);
  // The nearest hits of a tile's rays; distances are depths, and
  // normals are left out. From any thread, once the triangles
  // are sorted.
  void meet(int tile, TileHits& hits) const;

  // For rays that start elsewhere, or between the pixels' centres. The camera is that of sort().
  const CameraFrame& camera() const;
  float margin_px() const;
  const TileRays& rays(int tile) const;
  // Those that a tile may show, roughly the nearest first.
  void list(int tile, std::vector<const PlacedTriangle*>& triangles) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
