#include "sim/frame_geometry.h"

#include <cmath>

namespace diorama {

FrameGeometry::FrameGeometry(const Scene& scene, const Camera& camera, int frame)
    : camera_(camera),
      T_world_camera_(
          [&](double offset_s) { return scene.path->pose(scene.time_s(frame) + offset_s); },
          scene.row_time_s, camera.height()) {
  T_world_instance_.emplace_back([](double) { return SE3{}; }, 0, camera.height());
  for (const SceneObject& object : scene.objects)
    T_world_instance_.emplace_back(
        [&](double offset_s) { return object.pose(scene.time_s(frame) + offset_s); },
        object.path ? scene.row_time_s : 0, camera.height());
  if (rolling()) return;
  for (const RowPoses& pose : T_world_instance_)
    T_camera_instance_.emplace_back((T_world_camera(0).inverse() * pose.at(0)).matrix());
}

std::optional<ImagedPoint> FrameGeometry::project(int instance, const Vector3d& p_instance) const {
  if (!rolling()) {
    const Vector3d p_camera = T_camera_instance_[static_cast<size_t>(instance)] * p_instance;
    const std::optional<Vector2d> u = camera_.project(p_camera);
    if (!u) return std::nullopt;
    return ImagedPoint{*u, p_camera, 0};
  }
  constexpr int kMostSteps = 30;
  constexpr double kAgree_px = 1e-7;
  double row = (camera_.height() - 1) / 2.0;
  for (int step = 0; step < kMostSteps; ++step) {
    const Vector3d p_camera =
        T_world_camera(row).inverse() * (T_world_instance(instance, row) * p_instance);
    const std::optional<Vector2d> u = camera_.project(p_camera);
    if (!u) return std::nullopt;
    if (std::abs(u->y() - row) < kAgree_px) return ImagedPoint{*u, p_camera, row};
    row = u->y();
  }
  return std::nullopt;  // it crosses the image as fast as the shutter
}

}  // namespace diorama
