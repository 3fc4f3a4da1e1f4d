#include "mapper/present_view.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace diorama {

// In the right tangent at the believed pose, into which the measurement's is carried:
//   Z Exp(e) = B Exp(d) Exp(e) ~ B Exp(d + Jr^-1(d) e).
ObjectPrediction joinMeasurement(const ObjectPrediction& believed, const SE3& measured,
                                 const Matrix6d& covariance, double chi_square) {
  const Vector6d d = log(believed.T_camera_object.inverse() * measured);
  const Matrix6d J = rightJacobianInverse(d);
  const Matrix6d& P = believed.covariance;
  Matrix6d R = J * covariance * J.transpose();
  const double disagreement = d.dot((P + R).ldlt().solve(d));
  R *= std::max(1.0, disagreement / chi_square);
  // P (P + R)^-1, symmetric matrices all of them.
  const Matrix6d gain = (P + R).ldlt().solve(P).transpose();
  const Matrix6d joined = 2 * (P - gain * P);
  return {believed.T_camera_object * exp(Vector6d(gain * d)), 0.5 * (joined + joined.transpose())};
}

}  // namespace diorama
