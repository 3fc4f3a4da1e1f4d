#include "tracker/pose_verifier.h"

#include <algorithm>

#include "core/errors.h"

namespace diorama {

PoseVerifier::PoseVerifier(const ObjectModel& object, const EdgeModel& model, const Camera& camera,
                           const RayQuery& rays, int object_index, const TrackerOptions& options,
                           std::vector<DatabaseLook> looks, int look_points)
    : model_(model),
      camera_(camera),
      looks_(std::move(looks)),
      look_points_(look_points),
      plain_(std::all_of(looks_.begin(), looks_.end(), diorama::isPlain)),
      refiner_(model, object.mesh, camera, rays, object_index, options) {
  if (model.edges.empty())
    throw InputError(SourcePlace{object.name}, "the mesh has no edges that can be seen",
                     "give a mesh with faces of non-zero area");
}

void PoseVerifier::setImage(const Frame& frame, const MeanImage& means) {
  refiner_.setImage(frame, Covers::kIgnored);
  means_ = &means;
}

SE3 PoseVerifier::toModel(const SE3& T_camera_object) const {
  return T_camera_object * SE3{Eigen::Quaterniond::Identity(), model_.centre_object};
}

ExaminedPose PoseVerifier::describe(const Estimate& estimate) const {
  const SE3 T =
      estimate.T_camera_model * SE3{Eigen::Quaterniond::Identity(), -model_.centre_object};
  return {{T, estimate.health.value, look(T, look_points_)}, estimate.fit};
}

ExaminedPose PoseVerifier::examine(const ObjectPrediction& start) {
  if (!start.T_camera_object.isFinite()) return {{start.T_camera_object}};
  return describe(
      refiner_.refineStart(toModel(start.T_camera_object), independentPrior(start, model_)));
}

ExaminedPose PoseVerifier::polish(const ObjectPrediction& start) {
  if (!start.T_camera_object.isFinite()) return {{start.T_camera_object}};
  const auto prior = independentPrior(start, model_);
  const Estimate refined = refiner_.refine(toModel(start.T_camera_object), prior);
  return describe(refiner_.searchNeighbours(refined, prior));
}

std::optional<double> PoseVerifier::look(const SE3& T_camera_object, int most_points) const {
  return compareLooks(looks_, *means_, camera_, T_camera_object, model_.centre_object, most_points);
}

}  // namespace diorama
