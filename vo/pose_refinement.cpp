#include "vo/pose_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace diorama::vo {
namespace {

constexpr int kFewest = 6;      // features: below it the pose is not held with any certainty
constexpr int kHuberSteps = 3;  // Huber first, since Tukey forgets what is far off
constexpr double kHuber = 1.5, kTukey = 4.685;  // of the scale; Tukey: 95% efficiency
constexpr double kSmallestScale = 0.5;          // standard deviations
constexpr double kOutlier = 6;                  // of the scale: beyond Tukey's end
constexpr double kMedianToSigma = 0.85;  // median of a 2-vector of normal errors is 1.18 sigma
constexpr double kOneOfTwo = 1.745;      // ... over that of a single normal error, 0.6745 sigma
constexpr double kSettled = 1e-7;

double weightOf(double error, double scale, bool huber) {
  if (huber) return error < kHuber * scale ? 1 : kHuber * scale / error;
  const double x = error / (kTukey * scale);
  return x < 1 ? (1 - x * x) * (1 - x * x) : 0;
}

// Of a feature: the inverse square root of what is not known about its pixel and its point. Seen
// from the start of the refinement, which moves too little to change it.
Matrix2d whitenerOf(const Camera& camera, const Feature& feature, const SE3& T_camera_world,
                    const Matrix3d& R, double alike) {
  const auto projected =
      camera.projectWithJacobian(R * feature.point->p_world + T_camera_world.translation);
  if (!projected) return Matrix2d::Identity();
  const Matrix23d J_point = projected->J * R;
  const Eigen::LLT<Matrix2d> L(feature.covariance_px2 +
                               alike * J_point * feature.point->covariance * J_point.transpose());
  return L.matrixL().solve(Matrix2d::Identity());
}

std::vector<Matrix2d> whitenersOf(const Camera& camera, const TrackedFrame& frame) {
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  const Matrix3d R = T_camera_world.rotationMatrix();
  const double uncertain = static_cast<double>(frame.features.size()) - certainFeatures(frame);
  std::vector<Matrix2d> whiteners;
  whiteners.reserve(frame.features.size());
  for (const Feature& feature : frame.features)
    whiteners.push_back(whitenerOf(camera, feature, T_camera_world, R,
                                   isCertain(*feature.point, frame) ? 1 : uncertain));
  return whiteners;
}

// Residual and Jacobian of a feature, whitened.
struct Term {
  Vector2d residual_px, r;
  Matrix26d J;
};

std::optional<Term> termOf(const Camera& camera, const Feature& feature, const Matrix2d& whitener,
                           const Matrix3d& R, const Vector3d& t) {
  const Vector3d p_camera = R * feature.point->p_world + t;
  const auto projected = camera.projectWithJacobian(p_camera);
  if (!projected) return std::nullopt;
  Term term;
  term.residual_px = feature.u_px - projected->u_px;
  term.r = whitener * term.residual_px;
  term.J = poseJacobian(whitener * projected->J, p_camera);
  return term;
}

struct Linearised {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  std::vector<double> errors;  // standard deviations, one per feature that projects
};

Linearised linearise(const Camera& camera, const TrackedFrame& frame,
                     const std::vector<Matrix2d>& whiteners, double scale, bool huber) {
  Linearised sum;
  sum.errors.reserve(frame.features.size());
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  const Matrix3d R = T_camera_world.rotationMatrix();
  for (size_t i = 0; i < frame.features.size(); ++i) {
    const auto term =
        termOf(camera, frame.features[i], whiteners[i], R, T_camera_world.translation);
    if (!term) continue;
    const double error = term->r.norm(), w = weightOf(error, scale, huber);
    sum.H.noalias() += w * term->J.transpose() * term->J;
    sum.g.noalias() += w * term->J.transpose() * term->r;
    sum.errors.push_back(frame.features[i].isEdgelet() ? kOneOfTwo * error : error);
  }
  return sum;
}

// Errors of the features are `scale` times what they should be; the prior's is what it is.
void addPrior(const PositionPrior& prior, double scale, const SE3& T_world_camera,
              Linearised& sum) {
  const double information = scale * scale / prior.variance;
  sum.H.topLeftCorner<3, 3>().diagonal().array() += information;
  sum.g.head<3>() += information * (T_world_camera.rotation.conjugate() *
                                    (prior.mean - T_world_camera.translation));
}

double scaleOf(std::vector<double> errors) {
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return std::max(kSmallestScale, kMedianToSigma * *middle);
}

Vector2d whitenedResidual(const Feature& feature, const Vector2d& residual_px) {
  if (!feature.isEdgelet()) return feature.covariance_px2.llt().matrixL().solve(residual_px);
  const Vector2d& n = feature.normal;
  return {n.dot(residual_px) / std::sqrt(n.dot(feature.covariance_px2 * n)), 0};
}

// Keeps the features that agree.
void dropOutliers(const Camera& camera, TrackedFrame& frame, const std::vector<Matrix2d>& whiteners,
                  double limit, const VoOptions& options, PoseRefinement& result) {
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  const Matrix3d R = T_camera_world.rotationMatrix();
  double squares = 0;
  size_t next = 0;  // features are visited once, in order
  std::erase_if(frame.features, [&](Feature& feature) {
    const auto term = termOf(camera, feature, whiteners[next++], R, T_camera_world.translation);
    const double error_px = term ? feature.errorPx(term->residual_px) : 1e9;
    if (error_px > options.outlier_px || term->r.norm() > limit) {
      result.disagreed.push_back(feature.point);
      return true;
    }
    result.hessian.noalias() += term->J.transpose() * term->J;
    feature.residual = whitenedResidual(feature, term->residual_px);
    squares += error_px * error_px;
    return false;
  });
  result.agreed = static_cast<int>(frame.features.size());
  result.agreed_settled = settledFeatures(frame);
  result.rms_px = std::sqrt(squares / std::max(1, result.agreed));
}

}  // namespace

PoseRefinement refinePose(const Camera& camera, TrackedFrame& frame, const VoOptions& options,
                          const std::optional<PositionPrior>& prior) {
  double scale = 1;
  PoseRefinement result;
  const std::vector<Matrix2d> whiteners = whitenersOf(camera, frame);
  for (int i = 0; i < options.refine_iterations; ++i) {
    Linearised sum = linearise(camera, frame, whiteners, scale, i < kHuberSteps);
    if (sum.errors.size() < kFewest) return result;
    if (prior) addPrior(*prior, scale, frame.T_world_camera, sum);
    if (i <= kHuberSteps) scale = scaleOf(sum.errors);
    const Vector6d step = sum.H.ldlt().solve(sum.g);
    if (!step.allFinite()) return result;
    frame.T_world_camera = frame.T_world_camera * exp(step);
    if (!frame.T_world_camera.isFinite()) return result;
    if (step.norm() < kSettled && i > kHuberSteps) break;
  }
  result.converged = true;
  dropOutliers(camera, frame, whiteners, kOutlier * scale, options, result);
  return result;
}

}  // namespace diorama::vo
