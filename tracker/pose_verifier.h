// What one image says about a pose of an object that nothing else is known about.
#pragma once

#include <optional>
#include <vector>

#include "core/object_detector.h"
#include "core/object_model.h"
#include "tracker/appearance.h"
#include "tracker/edge_model.h"
#include "tracker/pose_refiner.h"

namespace diorama {

// Health and look say whether a pose is right at all. Which one of two is the better one in the
// same image is told by how sharply its edges agree.
struct ExaminedPose : Detection {
  double fit = 0;
  double rank() const { return fit + look.value_or(0); }
};

class PoseVerifier {
 public:
  // All references must outlive this object. Throws InputError when the mesh has no edges.
  PoseVerifier(const ObjectModel& object, const EdgeModel& model, const Camera& camera,
               const RayQuery& rays, int object_index, const TrackerOptions& options,
               std::vector<DatabaseLook> looks, int look_points);

  // The image that the calls below are about; must outlive them.
  void setImage(const Frame& frame, const MeanImage& means);

  // The pose that the image's edges lead to from here, and what is known independently of them: its
  // health and look.
  ExaminedPose examine(const ObjectPrediction& start);
  // The same from poses side by side whose edges lie some pixels apart, too: a narrow or round
  // thing looks nearly alike from several sides.
  ExaminedPose polish(const ObjectPrediction& start);
  // How much the object looks like itself at a pose, in [-1, 1], at so many points.
  std::optional<double> look(const SE3& T_camera_object, int most_points) const;

  bool isPlain() const { return plain_; }  // it has no print at all

 private:
  SE3 toModel(const SE3& T_camera_object) const;
  ExaminedPose describe(const Estimate& estimate) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const std::vector<DatabaseLook> looks_;
  const int look_points_;
  const bool plain_;
  PoseRefiner refiner_;
  const MeanImage* means_ = nullptr;
};

}  // namespace diorama
