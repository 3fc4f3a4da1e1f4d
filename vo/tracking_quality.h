// Whether a tracked pose is to be believed, and how exact the step to it is.
#pragma once

#include <string>
#include <vector>

#include "vo/pose_refinement.h"
#include "vo/reprojection.h"

namespace diorama::vo {

struct Assessment {
  bool good = false;
  double health = 0;   // in [0, 1]
  std::string reason;  // why it is not good
  Matrix6d hessian = Matrix6d::Zero();
  std::vector<MapPoint*> failed;  // points that were not found or did not agree
};

class TrackingQuality {
 public:
  explicit TrackingQuality(const VoOptions& options) : options_(options) {}

  // A frame that follows a good one.
  Assessment assess(const TrackedFrame& frame, const ReprojectionResult& reprojected,
                    const PoseRefinement& refined);
  // A pose tried after a loss: it must explain more, since many are tried.
  Assessment assessRecovery(const ReprojectionResult& reprojected, const PoseRefinement& refined);

 private:
  VoOptions options_;
  double usual_agreed_ = 0;  // features, over the last good frames; 0 = unknown
};

// Covariance of the motion between two tracked frames, right tangent at the second. Errors of the
// map are common to both: what counts is how much the residual of the same point differs between
// them.
Matrix6d stepCovariance(const TrackedFrame& before, const TrackedFrame& now,
                        const Matrix6d& hessian, const VoOptions& options);

}  // namespace diorama::vo
