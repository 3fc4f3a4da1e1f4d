// Robust kernels: rho(s) instead of the squared whitened residual s = |W r|^2.
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace ceres {
class LossFunction;
}

namespace diorama {

struct RobustKernel {
  enum class Kind {
    kNone,        // s
    kHuber,       // s up to c^2, then 2 c sqrt(s) - c^2
    kCauchy,      // c^2 log(1 + s / c^2)
    kCauchyTail,  // s up to c^2, then c^2 (1 + log(s / c^2)): good measurements count in full
  };
  Kind kind = Kind::kNone;
  double width = 1;  // c

  struct Value {
    double rho, slope, curvature;  // rho(s), rho'(s), rho''(s)
  };
  Value operator()(double s) const;
};

std::optional<RobustKernel::Kind> kernelFromString(const std::string& name);

// The same for Ceres; null for none.
std::unique_ptr<ceres::LossFunction> makeLoss(const RobustKernel& kernel);

}  // namespace diorama
