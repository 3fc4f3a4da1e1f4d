#include "vo/object_scale.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace diorama::vo {

bool isUsable(const ObjectMeasurement& m) {
  return m.claimed && m.health > 0 && m.T_camera_object.isFinite() && m.covariance.allFinite() &&
         m.covariance.llt().info() == Eigen::Success;
}

Matrix6d covarianceOf(const ObjectMeasurement& m, const VoOptions& options) {
  Matrix6d covariance = options.object_sigma_scale * options.object_sigma_scale * m.covariance;
  const double floor_m = options.object_sigma_min_m, floor_rad = options.object_sigma_min_rad;
  covariance.diagonal().head<3>().array() += floor_m * floor_m;
  covariance.diagonal().tail<3>().array() += floor_rad * floor_rad;
  return covariance;
}

int attachObjects(Map& map, Keyframe& keyframe, std::span<const ObjectMeasurement> objects,
                  const VoOptions& options) {
  int added = 0;
  for (const ObjectMeasurement& m : objects) {
    if (!isUsable(m)) continue;
    const size_t known = map.objects.size(), index = map.objectIndex(m.object);
    if (index == known)
      map.objects[index].T_world_object = keyframe.T_world_camera * m.T_camera_object;
    keyframe.objects.push_back({index, m.T_camera_object, covarianceOf(m, options).inverse()});
    ++added;
  }
  return added;
}

void placeObject(Map& map, size_t object) {
  for (const auto& keyframe : map.keyframes)
    for (const ObjectObservation& o : keyframe->objects)
      if (o.object == object)
        map.objects[object].T_world_object = keyframe->T_world_camera * o.T_camera_object;
}

Vector3d pathOfObject(const SE3& T_a_b, const SE3& T_a_object, const SE3& T_b_object) {
  return T_a_object.translation - T_a_b.rotation * T_b_object.translation;
}

std::optional<double> scaleFromObjects(const Map& map) {
  constexpr double kShortest = 0.1;  // motion over the distance of the object, to be of use
  constexpr int kFewestPairs = 3;
  double product = 0, square = 0;
  int pairs = 0;
  for (const auto& a : map.keyframes)
    for (const auto& b : map.keyframes) {
      if (a->id >= b->id) continue;
      const SE3 T_a_b = a->T_world_camera.inverse() * b->T_world_camera;
      for (const ObjectObservation& in_a : a->objects)
        for (const ObjectObservation& in_b : b->objects) {
          if (in_a.object != in_b.object) continue;
          const Vector3d by_object =
              pathOfObject(T_a_b, in_a.T_camera_object, in_b.T_camera_object);
          if (by_object.norm() < kShortest * in_a.T_camera_object.translation.norm()) continue;
          product += by_object.dot(T_a_b.translation);
          square += T_a_b.translation.squaredNorm();
          ++pairs;
        }
    }
  if (pairs < kFewestPairs || !(product > 0) || !(square > 0)) return std::nullopt;
  return product / square;
}

ObjectResidual objectResidual(const SE3& T_world_camera, const SE3& T_world_object,
                              const SE3& T_camera_object_measured) {
  const SE3 T_camera_object = T_world_camera.inverse() * T_world_object;
  ObjectResidual out;
  out.r = log(T_camera_object_measured.inverse() * T_camera_object);
  out.J_object = rightJacobianInverse(out.r);
  out.J_camera = -out.J_object * adjoint(T_camera_object.inverse());
  return out;
}

double scaleSigma(const Map& map) {
  // Unknowns: the logarithm of the scale, and each object's pose; the path only stretches about the
  // first keyframe: d T_world_camera / d log s = [R^T (t - t_0), 0].
  if (map.keyframes.empty()) return std::numeric_limits<double>::infinity();
  const Vector3d origin = map.keyframes.front()->T_world_camera.translation;
  const size_t objects = map.objects.size();
  double information = 0;
  std::vector<Matrix6d> H(objects, Matrix6d::Zero());
  std::vector<Vector6d> coupling(objects, Vector6d::Zero());
  for (const auto& keyframe : map.keyframes)
    for (const ObjectObservation& o : keyframe->objects) {
      const SE3& T = keyframe->T_world_camera;
      const ObjectResidual e =
          objectResidual(T, map.objects[o.object].T_world_object, o.T_camera_object);
      Vector6d stretch = Vector6d::Zero();
      stretch.head<3>() = T.rotation.conjugate() * (T.translation - origin);
      const Vector6d j = e.J_camera * stretch;
      information += j.dot(o.information * j);
      H[o.object] += e.J_object.transpose() * o.information * e.J_object;
      coupling[o.object] += e.J_object.transpose() * o.information * j;
    }
  for (size_t i = 0; i < objects; ++i)
    if (H[i].diagonal().minCoeff() > 0)
      information -= coupling[i].dot(H[i].ldlt().solve(coupling[i]));
  return information > 0 ? 1 / std::sqrt(information) : std::numeric_limits<double>::infinity();
}

bool ScaleLearning::wantsObjects(int64_t now_ns) const {
  if (!since_ns_) return true;
  return !known_ && 1e-9 * static_cast<double>(now_ns - *since_ns_) <= options_.scale_time_s;
}

void ScaleLearning::assess(const Map& map) {
  if (!begun() || known_) return;
  const double sigma = scaleSigma(map);
  sigma_ = std::min(sigma_, sigma);
  known_ = sigma < options_.scale_sigma &&
           static_cast<int>(map.keyframes.size()) >= options_.scale_min_keyframes;
}

}  // namespace diorama::vo
