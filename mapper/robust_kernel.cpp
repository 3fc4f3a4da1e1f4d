#include "mapper/robust_kernel.h"

#include <ceres/loss_function.h>

#include <cmath>

namespace diorama {
namespace {

class KernelLoss final : public ceres::LossFunction {
 public:
  explicit KernelLoss(const RobustKernel& kernel) : kernel_(kernel) {}
  void Evaluate(double s, double rho[3]) const override {
    const RobustKernel::Value value = kernel_(s);
    rho[0] = value.rho;
    rho[1] = value.slope;
    rho[2] = value.curvature;
  }

 private:
  RobustKernel kernel_;
};

}  // namespace

RobustKernel::Value RobustKernel::operator()(double s) const {
  const double c2 = width * width;
  switch (kind) {
    case Kind::kHuber:
      if (s > c2)
        return {2 * width * std::sqrt(s) - c2, width / std::sqrt(s),
                -width / (2 * s * std::sqrt(s))};
      break;
    case Kind::kCauchy:
      return {c2 * std::log1p(s / c2), c2 / (c2 + s), -c2 / ((c2 + s) * (c2 + s))};
    case Kind::kCauchyTail:
      if (s > c2) return {c2 * (1 + std::log(s / c2)), c2 / s, -c2 / (s * s)};
      break;
    case Kind::kNone:
      break;
  }
  return {s, 1, 0};
}

std::optional<RobustKernel::Kind> kernelFromString(const std::string& name) {
  using Kind = RobustKernel::Kind;
  if (name == "none") return Kind::kNone;
  if (name == "huber") return Kind::kHuber;
  if (name == "cauchy") return Kind::kCauchy;
  if (name == "cauchy_tail") return Kind::kCauchyTail;
  return std::nullopt;
}

std::unique_ptr<ceres::LossFunction> makeLoss(const RobustKernel& kernel) {
  if (kernel.kind == RobustKernel::Kind::kNone) return nullptr;
  return std::make_unique<KernelLoss>(kernel);
}

}  // namespace diorama
