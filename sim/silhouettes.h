// The silhouettes of tracked objects, each drawn alone.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "sim/direction_box.h"
#include "sim/ray_table.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"
#include "sim/row_cameras.h"
#include "sim/truth_buffer.h"
#include "sim/worker_pool.h"

namespace diorama {

class SilhouetteTracer {
 public:
  SilhouetteTracer(const RenderScene& scene, const Camera& camera, const RayTable& table);
  ~SilhouetteTracer();

  // One Silhouette per tracked object. `moving`: the camera relative to each moving object. Pixels
  // in which the truth shows the object need no ray.
  std::vector<Silhouette> trace(const RowCameras& cameras, std::span<const RowCameras> moving,
                                const TruthBuffer& truth, WorkerPool& pool);

 private:
  void traceInside(int id, const RowCameras& cameras, const TruthBuffer& truth, WorkerPool& pool,
                   Silhouette& silhouette) const;
  int countOutside(const SceneInstance& instance, const RowCameras& cameras, WorkerPool& pool,
                   PixelBox& outside);

  const RenderScene& scene_;
  const Camera& camera_;
  const RayTable& table_;
  std::vector<DirectionBox> tile_boxes_;
  std::unique_ptr<ExtendedGrid> beyond_;  // made when first needed
};

}  // namespace diorama
