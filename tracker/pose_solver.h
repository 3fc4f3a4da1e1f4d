// Robust Gauss-Newton on a pose, from any number of cues that each give one set of normal
// equations.
#pragma once

#include <span>
#include <vector>

#include "core/se3.h"

namespace diorama {

// What one cue says about the pose near T_camera_model, in the right tangent [rho, phi]. Residuals
// are divided by their robust scale, and correlated ones count less, so that cues add and the
// Hessian is the information that they hold.
struct CueEquations {
  Matrix6d hessian = Matrix6d::Zero();   // sum w J^T J / sigma^2
  Vector6d gradient = Vector6d::Zero();  // sum w J^T r / sigma^2
  // Covariance of the gradient from errors that many residuals share, which more of them do not
  // lessen; not in the Hessian.
  Matrix6d shared = Matrix6d::Zero();
  double sigma_px = 0;  // robust scale of the residuals
  int residuals = 0;    // scalars that could be evaluated

  void add(const Vector6d& jacobian, double residual, double weight) {
    hessian.noalias() += (weight * jacobian) * jacobian.transpose();
    gradient.noalias() += (weight * residual) * jacobian;
  }
};

// Edges, texture, and whatever else sees the object.
class Cue {
 public:
  virtual ~Cue() = default;
  virtual CueEquations linearise(const SE3& T_camera_model) = 0;
};

// d u_px / d xi of a point p of the model: J_projection R [I | -[p]x].
Matrix26d pointJacobian(const Matrix23d& J_projection, const Matrix3d& R_camera_model,
                        const Vector3d& p_model);

// Median of |residuals| as the standard deviation of a normal distribution; the order of the
// values is lost. 0 for none.
double robustScale(std::vector<double>& absolute_residuals);

// Weight of a residual in units of its scale; 0 beyond the constant.
inline double tukeyWeight(double scaled_residual, double constant) {
  const double q = scaled_residual / constant;
  return q * q >= 1 ? 0 : (1 - q * q) * (1 - q * q);
}

struct SolverLimits {
  int iterations = 3;
  double damping = 1e-4;      // relative, on the diagonal
  double model_diameter = 1;  // m; a longer step is refused
  int min_residuals = 8;
  // A trust region: xi' motion xi is at most about 1 for a step xi. Zero: steps of any length.
  Matrix6d motion = Matrix6d::Zero();
};

struct PoseSolution {
  SE3 T_camera_model;
  std::vector<CueEquations> cues;  // of each cue at the returned pose

  // Of all cues together: the inverse of the pose's covariance.
  Matrix6d hessian() const;
};

// Never returns a pose that is not finite or behind the camera: a step that leads there is not
// taken.
PoseSolution solvePose(const SE3& start, std::span<Cue* const> cues, const SolverLimits& limits);

// The inverse of a Hessian, symmetric and positive definite: directions that it does not determine
// have the standard deviations of an unknown pose (largest_sigma_m, largest_sigma_rad).
Matrix6d covarianceFromHessian(const Matrix6d& hessian, double largest_sigma_m,
                               double largest_sigma_rad);

}  // namespace diorama
