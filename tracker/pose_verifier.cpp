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
      plain_(arePlain(looks_)),
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

ExaminedPose PoseVerifier::describe(const Estimate& estimate, bool in_part) const {
  const SE3 T =
      estimate.T_camera_model * SE3{Eigen::Quaterniond::Identity(), -model_.centre_object};
  const PartialLook seen = in_part ? lookInPart(T) : PartialLook{look(T, look_points_)};
  return {{T, estimate.health.value, seen.agreement}, estimate.fit, seen.share, seen.part};
}

PartialLook PoseVerifier::lookInPart(const SE3& T_camera_object) const {
  return compareLooksInPart(looks_, *means_, camera_, T_camera_object, model_.centre_object,
                            kUnseenCost, look_points_);
}

ExaminedPose PoseVerifier::examinePart(const SE3& start) {
  if (!start.isFinite()) return {{start}};
  refiner_.setPart(lookInPart(start).part);
  const ExaminedPose examined = describe(refiner_.refineStart(toModel(start)), true);
  refiner_.setPart({});
  return examined;
}

ExaminedPose PoseVerifier::examine(const ObjectPrediction& start) {
  if (!start.T_camera_object.isFinite()) return {{start.T_camera_object}};
  return describe(
      refiner_.refineStart(toModel(start.T_camera_object), independentPrior(start, model_)));
}

ExaminedPose PoseVerifier::polish(const ObjectPrediction& start, const ImagePart& part) {
  if (!start.T_camera_object.isFinite()) return {{start.T_camera_object}};
  const auto prior = independentPrior(start, model_);
  refiner_.setPart(part);
  const Estimate refined = refiner_.refine(toModel(start.T_camera_object), prior);
  const ExaminedPose polished =
      describe(refiner_.searchNeighbours(refined, prior), !part.normal.isZero(0));
  refiner_.setPart({});
  return polished;
}

std::optional<double> PoseVerifier::look(const SE3& T_camera_object, int most_points) const {
  return (plain_ ? compareColors : compareLooks)(looks_, *means_, camera_, T_camera_object,
                                                 model_.centre_object, most_points);
}

}  // namespace diorama
