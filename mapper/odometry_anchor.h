// An odometry with a map of its own drifts less than its steps add up to: while it looks at the
// same place, it holds the camera against that. Its error is a Gauss-Markov process,
//   e(k+1) = (1 - dt / tau) e(k) + n,  n the error of a step,
// of which the factors between poses are the part with tau = infinity. The rest is
//   |dt / tau e(k)|^2  weighed as a step is,
// an observation of the place where the odometry began to look there, from each pose, with the
// covariance (tau / dt)^2 Q. What is between the two forms adds up to the process' ends only.
//
// The place is a pose that nobody knows, in the graph an object without a name. It is left when the
// camera looks away from all that the map knows, when the odometry has a gap or another one goes
// on, or when what is measured contradicts it: then the odometry drifts as its steps say.
#pragma once

#include <optional>
#include <string>

#include "core/measurements.h"
#include "mapper/chain_smoother.h"

namespace diorama {

// The logarithm of an odometry's scale (odometry_scale.h), and one sigma.
struct ScaleEstimate {
  double s = 0, sigma = 0;
};

class OdometryAnchor {
 public:
  // tau, s; 0: an odometry without a map. `chi_square` is the limit of the innovation.
  OdometryAnchor(double memory_s, double sigma_scale, double chi_square)
      : memory_s_(memory_s), sigma_scale_(sigma_scale), chi_square_(chi_square) {}

  // After the step's pose has been added. `in_view`: the camera looks at something known.
  // An unknown scale is the same in all that is measured: together the observations hold the way
  // from the place, along which it shows, no better than one would.
  void addStep(ChainSmoother& smoother, const OdometryMeasurement& step, bool in_view,
               const ScaleEstimate& scale = {});
  void release(ChainSmoother& smoother);
  bool holds() const { return object_.has_value(); }

 private:
  double memory_s_, sigma_scale_, chi_square_;
  std::optional<size_t> object_;
  std::string source_;  // the odometry that looks at it
  SE3 T_anchor_camera_;
  double observations_ = 0;
  double chain_variance_ = 0;  // of T_anchor_camera_: traces of the steps' covariances
};

}  // namespace diorama
