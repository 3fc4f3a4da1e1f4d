// Semi-direct visual odometry (after SVO, Forster et al. 2014) whose scale comes from known
// objects: see odometry.cpp for the story of a frame.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/odometry.h"
#include "core/ray_query.h"
#include "vo/vo_options.h"

namespace diorama {

// Shapes of objects that it may be told of.
struct KnownShapes {
  std::shared_ptr<const RayQuery> rays;  // null: none
  std::vector<std::string> names;        // of the objects, as `rays` counts them
};

class VisualOdometry : public Odometry {
 public:
  explicit VisualOdometry(Camera camera, VoOptions options = {}, std::string source_name = "vo",
                          KnownShapes shapes = {});
  ~VisualOdometry() override;
  VisualOdometry(const VisualOdometry&) = delete;
  VisualOdometry& operator=(const VisualOdometry&) = delete;

  // Uses frame.gray only. Steps are such that the product of all of them is the newest pose in the
  // map: corrections of the map are in the step that follows them, and in its covariance. A frame
  // that does not fit the camera counts as one in which nothing was seen. Same input, same result.
  std::optional<OdometryMeasurement> track(const Frame& frame) override;
  bool wantsObjects() const override;
  void leaveOut(std::span<const ObjectMeasurement> moving) override;
  void update(std::span<const ObjectMeasurement> objects) override;
  bool started() const override;
  std::optional<SE3> locate(const std::string& object) const override;
  std::vector<OdometryEvent> events() const override;

  // The sparse map, for a report: points in the frame of the first keyframe, m.
  std::vector<Vector3d> mapPoints() const;
  int keyframeCount() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace diorama
