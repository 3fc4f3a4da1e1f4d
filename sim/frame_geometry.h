// How one frame of a scene is imaged: where the camera and the objects are while each row is
// exposed, and in which pixel a point shows.
#pragma once

#include <optional>
#include <vector>

#include "core/camera.h"
#include "sim/row_poses.h"
#include "sim/scene.h"

namespace diorama {

struct ImagedPoint {
  Vector2d u_px;      // may lie outside the image
  Vector3d p_camera;  // m, at the time of its row
  double row;         // whose time that is
};

// Instances are numbered as in the truth: 0 is the environment, whose frame is the world, i + 1 is
// Scene::objects[i]. Rows are real numbers: between two rows the shutter moves on evenly.
class FrameGeometry {
 public:
  // The camera must outlive it.
  FrameGeometry(const Scene& scene, const Camera& camera, int frame);

  const Camera& camera() const { return camera_; }
  bool rolling() const { return T_world_camera_.rolling(); }
  SE3 T_world_camera(double row) const { return T_world_camera_.at(row); }
  SE3 T_world_instance(int instance, double row) const {
    return T_world_instance_[static_cast<size_t>(instance)].at(row);
  }

  // Nothing where the camera has no pixel for it. With a rolling shutter the row and the pose of
  // its time depend on each other: iterated until they agree.
  std::optional<ImagedPoint> project(int instance, const Vector3d& p_instance) const;

 private:
  const Camera& camera_;
  RowPoses T_world_camera_;
  std::vector<RowPoses> T_world_instance_;
  std::vector<Eigen::Isometry3d> T_camera_instance_;  // empty when rolling
};

}  // namespace diorama
