// The silhouettes of tracked objects, each drawn alone.
#pragma once

#include <memory>
#include <vector>

#include "core/camera.h"
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

  // One Silhouette per tracked object. Pixels in which the truth shows the object need no ray.
  std::vector<Silhouette> trace(const RowCameras& cameras, const TruthBuffer& truth,
                                WorkerPool& pool);

 private:
  struct DirectionBox;
  struct Beyond;  // the pixel grid outside the image
  DirectionBox boxOf(const SceneInstance& instance, const SE3& T_camera_world) const;
  std::vector<DirectionBox> boxesOf(const SceneInstance& instance, const RowCameras& cameras, int y,
                                    int rows, int count) const;
  void traceInside(int id, const RowCameras& cameras, const TruthBuffer& truth, WorkerPool& pool,
                   Silhouette& silhouette) const;
  int countOutside(const SceneInstance& instance, const RowCameras& cameras, WorkerPool& pool);

  const RenderScene& scene_;
  const Camera& camera_;
  const RayTable& table_;
  std::vector<DirectionBox> tile_boxes_;
  std::unique_ptr<Beyond> beyond_;  // made when first needed
};

}  // namespace diorama
