#include "mapper/odometry_scale.h"

#include <cmath>

namespace diorama {
std::optional<size_t> OdometryScale::next(ChainSmoother& smoother, const OdometryMeasurement& step,
                                          bool elsewhere, bool anew) {
  if (sigma_ <= 0 && !step.up_to_scale) {
    forget(smoother);
    return std::nullopt;
  }
  const bool away = elsewhere && !step.up_to_scale;
  const bool other =
      !variable_ || anew || step.source != source_ || step.up_to_scale != up_to_scale_;
  if (other || (away && !elsewhere_)) {
    forget(smoother);
    variable_ = smoother.addScale(step.up_to_scale ? kUnknownScale
                                  : other          ? sigma_
                                                   : sigma_elsewhere_);
    source_ = step.source;
    up_to_scale_ = step.up_to_scale;
  }
  elsewhere_ = away;
  return variable_;
}

void OdometryScale::forget(ChainSmoother& smoother) {
  if (variable_) smoother.release(*variable_);
  variable_.reset();
}

ScaleEstimate OdometryScale::estimate(const ChainSmoother& smoother) const {
  if (!variable_) return {};
  return {smoother.logScale(*variable_), std::sqrt(smoother.objectCovariance(*variable_)(0, 0))};
}

}  // namespace diorama
