// The visible edges of tracked objects as polylines in the image, exact to a small part of a pixel.
#pragma once

#include <memory>
#include <vector>

#include "core/ground_truth.h"
#include "core/mesh_edges.h"
#include "sim/frame_geometry.h"
#include "sim/render_scene.h"
#include "sim/worker_pool.h"

namespace diorama {

// Calls are const and, with a pool for each caller, thread-safe.
class EdgeTracer {
 public:
  // Imports the meshes of the tracked objects.
  EdgeTracer(const Scene& scene, std::shared_ptr<const RenderScene> render_scene);

  // Sharp edges, boundaries and the edges on the silhouette, without what lies outside the image or
  // behind something: rays decide along the edge once a pixel, and where they begin to differ, to
  // within a thousandth of a pixel.
  std::vector<VisibleEdge> visible(const FrameGeometry& frame, WorkerPool& pool) const;

 private:
  struct Model {
    int object = 0;    // among the tracked ones
    int instance = 0;  // as in the truth
    MeshEdges mesh;
  };
  class Line;
  void addVisible(const Model& model, size_t edge, const FrameGeometry& frame,
                  std::vector<VisibleEdge>& out) const;

  std::shared_ptr<const RenderScene> render_scene_;
  std::vector<Model> models_;
};

}  // namespace diorama
