#include "mapper/odometry_scale.h"

#include <cmath>

namespace diorama {

std::optional<size_t> OdometryScale::next(ChainSmoother& smoother, const std::string& source,
                                          bool elsewhere, bool anew) {
  if (sigma_ <= 0) return std::nullopt;
  const bool other = !variable_ || anew || source != source_;
  if (other || (elsewhere && !elsewhere_)) {
    if (variable_) smoother.release(*variable_);
    variable_ = smoother.addScale(other ? sigma_ : sigma_elsewhere_);
    source_ = source;
  }
  elsewhere_ = elsewhere;
  return variable_;
}

ScaleEstimate OdometryScale::estimate(const ChainSmoother& smoother) const {
  if (!variable_) return {};
  return {smoother.logScale(*variable_), std::sqrt(smoother.objectCovariance(*variable_)(0, 0))};
}

}  // namespace diorama
