// An odometry that measures lengths by a map of its own errs by the same share in all its steps:
// its scale is as wrong as the depths were that it began with. The graph knows that as one more
// variable, s: steps are e^s times as long as measured. Without it, the many sights of an object
// from a path that is 0.2% too short put the object 0.2% too near, against what the tracker says of
// its distance; and a run of steps that all err alike is taken for far surer than it is.
//
// Where the camera has looked away from all that the map knows, the odometry measures by another
// map of its own, of which less is known: another s, from there on. So it does when it was lost and
// has begun anew. And while it does not know its scale at all, the steps have an s of which next to
// nothing is known, until objects tell: then all that was measured by it is as long as it was.
#pragma once

#include <optional>
#include <string>

#include "mapper/chain_smoother.h"
#include "mapper/odometry_anchor.h"

namespace diorama {

class OdometryScale {
 public:
  // One sigma of s: as the odometry started, and after it has looked elsewhere. 0: s is 0.
  OdometryScale(double sigma, double sigma_elsewhere)
      : sigma_(sigma), sigma_elsewhere_(sigma_elsewhere) {}

  // The variable for a step from the newest pose on. `elsewhere`: nothing known is in view. `anew`:
  // nothing joins the step to those before.
  std::optional<size_t> next(ChainSmoother& smoother, const OdometryMeasurement& step,
                             bool elsewhere, bool anew = false);
  // s as it is believed now, and one sigma.
  ScaleEstimate estimate(const ChainSmoother& smoother) const;

 private:
  void forget(ChainSmoother& smoother);

  double sigma_, sigma_elsewhere_;
  std::optional<size_t> variable_;
  std::string source_;
  bool up_to_scale_ = false;
  bool elsewhere_ = false;
};

}  // namespace diorama
