// Poses that cues of grey values find, and how far they are off.
#pragma once

#include "core/camera.h"
#include "core/image.h"
#include "tracker/edge_model.h"
#include "tracker/texture_cue.h"

namespace diorama::test {

// Mean distance between the projections of the model's corners.
inline double pixelError(const Camera& camera, const EdgeModel& model, const SE3& a, const SE3& b) {
  double sum = 0;
  for (const Vector3d& v : model.vertices)
    sum += (*camera.project(a * v) - *camera.project(b * v)).norm();
  return sum / static_cast<double>(model.vertices.size());
}

// By patches alone, from some millimetres beside the truth.
inline SE3 poseByPatches(TextureCue& cue, const Image<uint8_t>& image, const SE3& truth,
                         double model_diameter) {
  SE3 pose = truth * exp((Vector6d() << 0.002, -0.002, 0.003, 0.004, -0.003, 0.005).finished());
  Cue* const cues[] = {&cue};
  SolverLimits limits;
  limits.iterations = 5;
  limits.model_diameter = model_diameter;
  for (int round = 0; round < 2; ++round) {
    cue.align(image, pose, {});
    pose = solvePose(pose, cues, limits).T_camera_model;
  }
  return pose;
}

}  // namespace diorama::test
