#include "mapper/odometry_anchor.h"

#include <algorithm>

#include "mapper/relative_pose.h"

namespace diorama {

void OdometryAnchor::addStep(ChainSmoother& smoother, const OdometryMeasurement& step, bool in_view,
                             const ScaleEstimate& scale) {
  if (memory_s_ <= 0) return;
  if (!in_view) return release(smoother);
  if (step.source != source_) release(smoother);
  source_ = step.source;
  const size_t pose = smoother.poseCount() - 1;
  const SE3 T_anchor_camera = object_ ? T_anchor_camera_ * step.T_from_to : SE3{};
  // T_a_c Exp(e) inverted is T_c_a Exp(-Ad(T_a_c) e).
  const double steps =
      std::max(1.0, memory_s_ / (1e-9 * static_cast<double>(step.to_ns - step.from_ns)));
  // Vague steps, as of an odometry that does not know its scale yet, are in what comes after.
  const double kept = object_ ? 1 - 1 / steps : 0;
  chain_variance_ = kept * kept * chain_variance_ + step.covariance.trace();
  if (chain_variance_ > steps * steps * step.covariance.trace()) return release(smoother);
  observations_ = object_ ? observations_ + 1 : 1;
  const Matrix6d J = adjoint(T_anchor_camera);
  Matrix6d Q = steps * steps * sigma_scale_ * sigma_scale_ * step.covariance;
  const Vector3d along = T_anchor_camera.rotation.conjugate() * T_anchor_camera.translation;
  Q.topLeftCorner<3, 3>() += observations_ * scale.sigma * scale.sigma * along * along.transpose();
  const std::optional<Whitening> W = whitening(J * Q * J.transpose());
  if (!W) return release(smoother);
  if (!object_) object_ = smoother.addObject("", smoother.T_world_camera(pose));
  T_anchor_camera_ = T_anchor_camera;
  const ObjectFactor factor{*object_, scaled(T_anchor_camera_, scale.s).inverse(), *W};
  if (smoother.innovation(pose, factor).value_or(0) >= chi_square_) return release(smoother);
  smoother.addObservation(pose, factor);
}

void OdometryAnchor::release(ChainSmoother& smoother) {
  if (object_) smoother.release(*object_);
  object_.reset();
}

}  // namespace diorama
