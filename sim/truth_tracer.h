// Truth beyond depth and masks: normals and optical flow.
#pragma once

#include <memory>
#include <vector>

#include "core/flow_field.h"
#include "core/ground_truth.h"
#include "sim/frame_geometry.h"
#include "sim/render_scene.h"
#include "sim/worker_pool.h"

namespace diorama {

// Calls are const and, with a pool for each caller, thread-safe.
class TruthTracer {
 public:
  TruthTracer(std::shared_ptr<const RenderScene> scene, const Camera& camera);

  // Of the surfaces whose depth `truth` has, in the frame of the row's camera.
  Image<Normal> normals(const FrameGeometry& frame, const GroundTruth& truth,
                        WorkerPool& pool) const;

  // From each pixel's surface point, as `truth` has it, to where it is in the other frame; whether
  // it is seen there is decided by a ray of that frame's.
  FlowField flow(const FrameGeometry& from, const FrameGeometry& to, const GroundTruth& truth,
                 WorkerPool& pool) const;

 private:
  void normalsOfPixels(const FrameGeometry& frame, const GroundTruth& truth, int x0, int y,
                       Image<Normal>& normals) const;
  void flowOfPixels(const FrameGeometry& from, const FrameGeometry& to, const GroundTruth& truth,
                    int x0, int y, FlowField& field) const;

  std::shared_ptr<const RenderScene> scene_;
  Image<std::optional<Vector3d>> rays_;  // of the pixel centres, z = 1
};

}  // namespace diorama
