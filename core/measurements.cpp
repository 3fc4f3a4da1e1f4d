#include "core/measurements.h"

namespace diorama {

Matrix6d OdometryMeasurement::covarianceWithScale() const {
  Matrix6d sum = covariance;
  if (!up_to_scale) return sum;
  // T Exp([d t, 0]) in the frame of the newer camera.
  const Vector3d t = T_from_to.rotation.conjugate() * T_from_to.translation;
  sum.topLeftCorner<3, 3>() += t * t.transpose();
  return sum;
}

}  // namespace diorama
