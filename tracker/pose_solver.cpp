#include "tracker/pose_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

namespace diorama {

Matrix26d pointJacobian(const Matrix23d& J_projection, const Matrix3d& R_camera_model,
                        const Vector3d& p_model) {
  const Matrix23d a = J_projection * R_camera_model;
  Matrix26d J;
  J.leftCols<3>() = a;
  for (int i = 0; i < 2; ++i) J.block<1, 3>(i, 3) = p_model.cross(a.row(i).transpose()).transpose();
  return J;
}

double robustScale(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;  // Rousseeuw and Croux 1993
}

namespace {

// The Gauss-Newton step of all cues together; nothing when they do not determine one.
std::optional<Vector6d> stepOf(const std::vector<CueEquations>& cues, const SolverLimits& limits) {
  CueEquations sum;
  for (const CueEquations& cue : cues) {
    sum.hessian += cue.hessian;
    sum.gradient += cue.gradient;
    sum.residuals += cue.residuals;
  }
  if (sum.residuals < limits.min_residuals) return std::nullopt;
  sum.hessian.diagonal() *= 1 + limits.damping;
  Vector6d step = -sum.hessian.ldlt().solve(sum.gradient);
  const auto isLong = [&] { return !(step.dot(limits.motion * step) <= 1); };
  // Of what the cues hardly know they may not tell much.
  if (isLong()) step = -(sum.hessian + limits.motion).ldlt().solve(sum.gradient);
  if (isLong()) step /= std::sqrt(step.dot(limits.motion * step));
  if (!step.allFinite() || step.head<3>().norm() > limits.model_diameter) return std::nullopt;
  return step;
}

}  // namespace

Matrix6d PoseSolution::hessian() const {
  Matrix6d sum = Matrix6d::Zero();
  for (const CueEquations& cue : cues) sum += cue.hessian;
  return sum;
}

PoseSolution solvePose(const SE3& start, std::span<Cue* const> cues, const SolverLimits& limits) {
  PoseSolution solution{start, {}};
  const auto linearise = [&] {
    solution.cues.clear();
    for (Cue* cue : cues) solution.cues.push_back(cue->linearise(solution.T_camera_model));
  };
  linearise();
  for (int iteration = 0; iteration < limits.iterations; ++iteration) {
    const std::optional<Vector6d> step = stepOf(solution.cues, limits);
    if (!step) break;
    const SE3 next = solution.T_camera_model * exp(*step);
    // Nearer than a fifth of its size the object surrounds the camera.
    if (!next.isFinite() || next.translation.z() < 0.2 * limits.model_diameter) break;
    solution.T_camera_model = next;
    linearise();
    if (step->tail<3>().norm() < 1e-5 && step->head<3>().norm() < 1e-5 * next.translation.z())
      break;
  }
  return solution;
}

Matrix6d covarianceFromHessian(const Matrix6d& hessian, double largest_sigma_m,
                               double largest_sigma_rad) {
  Vector6d information;
  information << Vector3d::Constant(1 / (largest_sigma_m * largest_sigma_m)),
      Vector3d::Constant(1 / (largest_sigma_rad * largest_sigma_rad));
  Matrix6d H = hessian.allFinite() ? hessian : Matrix6d::Zero();
  H.diagonal() += information;
  const Matrix6d covariance = H.llt().solve(Matrix6d::Identity());
  if (!covariance.allFinite()) return information.cwiseInverse().asDiagonal();
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace diorama
