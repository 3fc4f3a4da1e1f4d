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

// What is hidden of an object costs so much of its look, times its share: a line can be found that
// leaves what happens to agree.
inline constexpr double kUnseenCost = 0.5;
// ... and where a line is looked for at all, more poses are tried: they must be proven better.
inline constexpr double kMoreInPart = 0.1;

// Health and look say whether a pose is right at all. Which one of two is the better one in the
// same image is told by how sharply its edges agree.
struct ExaminedPose : Detection {
  double fit = 0;
  double seen_share = 1;  // of the object; what is said of it is of this part
  ImagePart part = {};
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
  // The same of the part of it that something straight leaves to be seen.
  ExaminedPose examinePart(const SE3& start);
  // The same from poses side by side whose edges lie some pixels apart, too: a narrow or round
  // thing looks nearly alike from several sides.
  ExaminedPose polish(const ObjectPrediction& start, const ImagePart& part);
  // How much the object looks like itself at a pose, in [-1, 1], at so many points.
  std::optional<double> look(const SE3& T_camera_object, int most_points) const;

  bool isPlain() const { return plain_; }  // it has no print at all

 private:
  SE3 toModel(const SE3& T_camera_object) const;
  PartialLook lookInPart(const SE3& T_camera_object) const;
  ExaminedPose describe(const Estimate& estimate, bool in_part = false) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const std::vector<DatabaseLook> looks_;
  const int look_points_;
  const bool plain_;
  PoseRefiner refiner_;
  const MeanImage* means_ = nullptr;
};

}  // namespace diorama
