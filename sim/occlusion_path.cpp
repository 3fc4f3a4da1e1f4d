#include "sim/occlusion_path.h"

#include <cmath>
#include <numbers>

namespace diorama {
namespace {

// Below the floor of any room that stands on the earth.
constexpr double kBelow_m = -10;
constexpr double kBehind_m = 3;

class OccluderPath : public MotionPath {
 public:
  OccluderPath(const OccluderKind& kind, const OccluderTrack& track, const Scene& scene,
               const SceneObject& object, const Vector3d& object_middle)
      : kind_(kind),
        lane_(track.lane),
        camera_(scene.path),
        object_(object),
        object_middle_(object_middle),
        has_room_(!scene.environment_mesh.empty()) {
    std::vector<Keyframe> keyframes;
    for (size_t k = 0; k < track.slide_m.size(); ++k) {
      SE3 slide;
      slide.translation.x() = track.slide_m[k];
      keyframes.push_back({scene.time_s(track.first + static_cast<int>(k)), slide});
    }
    const double half_frame_s = 0.5 / scene.rate_hz;
    start_s_ = keyframes.front().time_s - half_frame_s;
    end_s_ = keyframes.back().time_s + half_frame_s;
    slide_ = makeSplinePath(keyframes);
  }

  SE3 pose(double time_s) const override {
    const SE3 T_world_camera = camera_->pose(time_s);
    if (time_s < start_s_ || time_s > end_s_) return away(T_world_camera);
    return occluderPose(kind_, lane_, T_world_camera.translation,
                        object_.pose(time_s) * object_middle_,
                        slide_->pose(time_s).translation.x());
  }

 private:
  SE3 away(const SE3& T_world_camera) const {
    if (!has_room_) return T_world_camera * SE3{Eigen::Quaterniond::Identity(), {0, 0, -kBehind_m}};
    return {Eigen::Quaterniond::Identity(), {0, 0, kBelow_m}};
  }

  OccluderKind kind_;
  OccluderLane lane_;
  MotionPathPtr camera_, slide_;
  SceneObject object_;
  Vector3d object_middle_;
  bool has_room_;
  double start_s_ = 0, end_s_ = 0;
};

}  // namespace

SE3 occluderPose(const OccluderKind& kind, const OccluderLane& lane, const Vector3d& camera,
                 const Vector3d& object, double slide_m) {
  const SE3 sight = lookAt(camera, object);
  const Matrix3d axes = sight.rotationMatrix();
  const Vector3d right = axes.col(0), up = -axes.col(1), forward = axes.col(2);
  const Vector3d side = std::cos(lane.side_rad) * right + std::sin(lane.side_rad) * up;
  Matrix3d R;  // columns: the occluder's axes in the world
  R.col(0) = right;
  R.col(2) = up;
  if (kind.reaches) {
    // Its x axis (a hand's thumb) points up or, when it comes from below or above, to the right.
    R.col(2) = -side;
    const Vector3d across = forward.cross(side);
    const double upwards = across.dot(up);
    const bool level = std::abs(upwards) < 0.5;
    R.col(0) = (level ? across.dot(right) : upwards) < 0 ? Vector3d(-across) : across;
  }
  R.col(1) = R.col(2).cross(R.col(0));
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(R).normalized();
  const Vector3d middle = camera + lane.distance_m * forward + slide_m * side;
  return {rotation, middle - rotation * kind.middle};
}

MotionPathPtr makeOccluderPath(const OccluderKind& kind, const OccluderTrack& track,
                               const Scene& scene, const SceneObject& object,
                               const Vector3d& object_middle) {
  return std::make_shared<OccluderPath>(kind, track, scene, object, object_middle);
}

}  // namespace diorama
