// Small patches of a keyframe on flat parts of the object, found again by translation: the cue for
// printed surfaces, whose inside says more than their outline.
#pragma once

#include <vector>

#include "core/camera.h"
#include "core/ray_query.h"
#include "tracker/edge_model.h"
#include "tracker/patch.h"
#include "tracker/pose_solver.h"
#include "tracker/print.h"
#include "tracker/surface_look.h"

namespace diorama {

class TextureCue : public Cue {
 public:
  // All references must outlive this object.
  TextureCue(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
             const TrackerOptions& options, double correlation);

  // Takes new patches from what is not covered in this image. There may be none. The pose's
  // covariance (right tangent) is an error that all patches share as long as this keyframe lives.
  void setKeyframe(const Image<uint8_t>& image, const SE3& T_camera_model,
                   const Matrix6d& covariance, const CoverMap& cover, const Print& print);
  // Patches that are known exactly.
  void setPatches(std::vector<Patch> patches, const SE3& T_camera_model);
  bool empty() const { return patches_.empty(); }

  // Whether new patches should be taken: there are none, the view has changed much, or few agree.
  bool keyframeNeeded(const SE3& T_camera_model) const;
  bool viewChanged(const SE3& T_camera_model, double view_cosine, double scale) const;

  // Finds the patches near where the pose says, unless something covers them.
  void align(const Image<uint8_t>& image, const SE3& T_camera_model, const CoverMap& cover);

  // Distances of projected patch centres to where they were found. The shared error of the keyframe
  // is marginalised: however many patches there are, they know no more than the keyframe's pose.
  CueEquations linearise(const SE3& T_camera_model) override;

  // What the last linearisation would have been, were the keyframe's pose exact.
  const CueEquations& givenKeyframe() const { return given_keyframe_; }

  // Learns the keyframe's error from what it and another cue say at one pose, and moves the patches
  // accordingly.
  void correctKeyframe(const CueEquations& given_keyframe, const CueEquations& other);

  // Patches that were found within max_distance_px of where the last linearisation saw them, and
  // all that could have been found (inside the image, facing the camera).
  struct Agreement {
    int agreeing = 0;
    int expected = 0;
  };
  Agreement agreement(double max_distance_px) const;

 private:
  void addPatch(const Image<uint8_t>& image, const SE3& T, const Vector2d& u_px,
                const Print& print);

  const EdgeModel& model_;
  const Camera& camera_;
  const RayQuery& rays_;
  int object_;
  const TrackerOptions& options_;
  const double correlation_;  // of the patches' errors: so many count as one
  std::vector<Patch> patches_;
  SE3 T_keyframe_;
  Matrix6d keyframe_covariance_ = Matrix6d::Zero();
  CueEquations given_keyframe_;
  std::vector<double> absolute_;
};

}  // namespace diorama
