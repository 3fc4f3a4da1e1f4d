#include "eval/alignment.h"

#include <Eigen/SVD>

#include "core/errors.h"

namespace diorama {

std::optional<Alignment> alignmentFromString(const std::string& name) {
  if (name == "none") return Alignment::kNone;
  if (name == "se3") return Alignment::kSE3;
  if (name == "sim3") return Alignment::kSim3;
  return std::nullopt;
}

Similarity umeyama(std::span<const Vector3d> source, std::span<const Vector3d> target,
                   Alignment alignment) {
  DIORAMA_CHECK(source.size() == target.size());
  if (source.empty() || alignment == Alignment::kNone) return {};
  const double n = static_cast<double>(source.size());
  Vector3d source_mean = Vector3d::Zero(), target_mean = Vector3d::Zero();
  for (size_t i = 0; i < source.size(); ++i) {
    source_mean += source[i] / n;
    target_mean += target[i] / n;
  }
  Matrix3d covariance = Matrix3d::Zero();  // Umeyama (38)
  double source_variance = 0;              // (36)
  for (size_t i = 0; i < source.size(); ++i) {
    covariance += (target[i] - target_mean) * (source[i] - source_mean).transpose() / n;
    source_variance += (source[i] - source_mean).squaredNorm() / n;
  }
  const Eigen::JacobiSVD<Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs = Vector3d::Ones();  // (43): a rotation, not a reflection
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  const Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();  // (40)
  Similarity out;
  // Coincident points, also by rounding, leave the rotation as it is.
  if (svd.singularValues()[0] > 1e-24) out.T_target_source.rotation = Eigen::Quaterniond(R);
  if (alignment == Alignment::kSim3 && source_variance > 1e-24)
    out.scale = svd.singularValues().dot(signs) / source_variance;  // (42)
  out.T_target_source.rotation.normalize();
  out.T_target_source.translation =
      target_mean - out.scale * (out.T_target_source.rotation * source_mean);  // (41)
  return out;
}

}  // namespace diorama
