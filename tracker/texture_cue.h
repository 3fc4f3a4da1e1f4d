// Small patches of a keyframe on flat parts of the object, found again by translation: the cue for
// printed surfaces, whose inside says more than their outline.
#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "core/ray_query.h"
#include "tracker/edge_model.h"
#include "tracker/image_pyramid.h"
#include "tracker/pose_solver.h"
#include "tracker/surface_look.h"

namespace diorama {

class TextureCue : public Cue {
 public:
  // All references must outlive this object.
  TextureCue(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
             const TrackerOptions& options);

  // Takes new patches from what is not covered in this image. There may be none. The pose's
  // covariance (right tangent) is an error that all patches share as long as this keyframe lives.
  void setKeyframe(const Image<uint8_t>& image, const SE3& T_camera_model,
                   const Matrix6d& covariance, const CoverMap& cover);
  void forget() { patches_.clear(); }
  bool empty() const { return patches_.empty(); }

  // Whether the view has changed so much that new patches should be taken.
  bool keyframeNeeded(const SE3& T_camera_model) const;

  // Finds the patches near where the pose says, unless something covers them.
  void align(const Image<uint8_t>& image, const SE3& T_camera_model, const CoverMap& cover);

  // Distances of projected patch centres to where they were found. The shared error of the keyframe
  // is marginalised: however many patches there are, they know no more than the keyframe's pose.
  CueEquations linearise(const SE3& T_camera_model) override;

  // Learns the keyframe's error from what another cue says at the pose of the last linearisation,
  // and moves the patches accordingly.
  void correctKeyframe(const CueEquations& other);

  // Patches that were found within max_distance_px of where the last linearisation saw them, and
  // all that could have been found (inside the image, facing the camera).
  struct Agreement {
    int agreeing = 0;
    int expected = 0;
  };
  Agreement agreement(double max_distance_px) const;

 private:
  static constexpr int kRadius = 4;  // px
  static constexpr size_t kPixels = (2 * kRadius + 1) * (2 * kRadius + 1);
  static constexpr size_t kWhole = (kPixels + 7) / 8 * 8;  // whole vectors; zeros behind the end
  using Values = Eigen::Array<float, kWhole, 1>;

  struct Patch {
    Vector3d p, along_x, along_y;  // m, model frame: centre, and one pixel to the right and down
    Values grey, gradient_x, gradient_y;  // grey without its mean
    Matrix2d inverse_hessian;
    float norm = 0;  // of grey
    // In the current image:
    bool expected = false, found = false;
    Vector2d u_px;
    double distance_px = 0;
  };

  static bool touchesCover(const CoverMap& cover, const Vector2d& u_px);
  void addPatch(const Image<uint8_t>& image, const SE3& T, const Vector2d& u_px);
  bool fillValues(const Image<uint8_t>& image, int x, int y, Patch& patch) const;
  static void readPatch(const Image<uint8_t>& image, const Vector2d& u_px, const Vector2d& a,
                        const Vector2d& b, Values& out);
  void alignPatch(const Image<uint8_t>& image, const SE3& T, const CoverMap& cover,
                  Patch& patch) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const RayQuery& rays_;
  int object_;
  const TrackerOptions& options_;
  std::vector<Patch> patches_;
  SE3 T_keyframe_;
  Matrix6d keyframe_covariance_ = Matrix6d::Zero();
  CueEquations given_keyframe_;  // of the last linearisation, were the keyframe's pose exact
  std::vector<double> absolute_;
};

}  // namespace diorama
