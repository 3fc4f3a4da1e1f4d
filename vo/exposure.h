// How long the shutter is open, learnt from the image: patches of sharp keyframes are found best in
// a moving frame when they are blurred as it is.
#pragma once

#include "core/camera.h"
#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// How far a point moves in the frame's image while the shutter is open, px.
Vector2d smearOf(const Camera& camera, const TrackedFrame& frame, const Vector3d& p_camera);

// ... in addition to what blurs its patch in the reference already.
Vector2d smearOf(const Camera& camera, const TrackedFrame& frame, const TrackedFrame& reference,
                 const Vector3d& p_world);

// Pyramid levels that the motion from the last frame to this one may have blurred at least.
int blurredLevels(const Camera& camera, const TrackedFrame& last, const TrackedFrame& now);

class ExposureLearning {
 public:
  explicit ExposureLearning(const VoOptions& options) : options_(options) {}

  // Of the time from frame to frame.
  double share() const { return options_.blur_patches ? share_ : 0; }
  // From the features of an accepted frame that move fast enough to tell.
  void learn(const Camera& camera, const TrackedFrame& frame);

 private:
  static constexpr double kStep = 1.0 / 16;

  const VoOptions& options_;
  double share_ = 0.25;                         // until something is known
  double shorter_ = 0, same_ = 0, longer_ = 0;  // grey levels that remain, summed over features
  int count_ = 0;
};

}  // namespace diorama::vo
