// The main path of the detection. For each object:
//
//   match      features of the image with those of the database
//   pose       RANSAC PnP, robust refinement over all inliers
//   verify     the edge tracker starts from the pose: do the edges in the image agree, and does
//              the object look as it did in the training?
//   again      without the inliers, when they do not
//   templates  of its edges, where the object has hardly any texture; verified alike
#include "tracker/database_detector.h"

#include <algorithm>
#include <map>

#include "core/errors.h"
#include "tracker/edge_templates.h"
#include "tracker/feature_matcher.h"
#include "tracker/object_tracker.h"
#include "tracker/pose_ransac.h"

namespace diorama {

// A frame, and what is made of it once for all objects.
struct DatabaseDetector::Picture {
  const Frame& frame;
  MeanImage means;
};

class DatabaseDetector::Finder {
 public:
  Finder(DetectorObject object, int index, const Camera& camera,
         std::shared_ptr<const RayQuery> rays, const DetectorOptions& options,
         const TrackerOptions& tracker_options)
      : options_(options),
        camera_(camera),
        database_(std::move(object.database)),
        diameter_(object.model.mesh.diameter()),
        object_(index),
        tracker_options_(tracker_options),
        rays_(std::move(rays)),
        model_(makeEdgeModel(object.model.mesh, tracker_options_)),
        matcher_(database_, options.same_place * diameter_),
        verifier_(std::move(object.model), camera, rays_, index, tracker_options) {
    const double features = static_cast<double>(database_.features.size());
    if (features <= options.templates.max_features * static_cast<double>(database_.views.size()))
      templates_.emplace(model_, camera_, *rays_, index, tracker_options_, options_.templates);
  }

  FeatureKind kind() const { return database_.kind; }
  bool hasTemplates() const { return templates_.has_value(); }

  std::optional<Detection> findByFeatures(const Picture& picture, const Features& features);
  std::optional<Detection> findByEdges(const Picture& picture, const ChamferMaps& maps);

 private:
  std::vector<PointMatch> match(const Features& features) const;
  std::optional<double> look(const Picture& picture, const SE3& T_camera_object) const;
  Detection examine(const Picture& picture, const SE3& T_camera_object, int inliers);
  bool isProven(const Detection& detection) const;

  const DetectorOptions& options_;
  const Camera& camera_;
  const ObjectDatabase database_;
  const double diameter_;
  const int object_;
  const TrackerOptions tracker_options_;
  const std::shared_ptr<const RayQuery> rays_;
  const EdgeModel model_;
  const FeatureMatcher matcher_;
  EdgeTracker verifier_;
  std::optional<EdgeTemplates> templates_;
};

std::vector<PointMatch> DatabaseDetector::Finder::match(const Features& features) const {
  std::vector<PointMatch> matches;
  for (const FeatureMatch& m : matcher_.match(features, options_.match_ratio)) {
    const DatabaseFeature& place = database_.features[static_cast<size_t>(m.feature)];
    const Vector3d p = place.p_object.cast<double>();
    const Vector3d eye = database_.views[static_cast<size_t>(place.view)].inverse().translation;
    matches.push_back(
        {p, (eye - p).normalized(), features.points[static_cast<size_t>(m.point)].u_px});
  }
  return matches;
}

std::optional<Detection> DatabaseDetector::Finder::findByFeatures(const Picture& picture,
                                                                  const Features& features) {
  std::vector<PointMatch> matches = match(features);
  const Random random(static_cast<uint64_t>(object_), RandomStream::kDetector);
  for (int k = 0; k < options_.hypotheses; ++k) {
    const auto pose = findPose(matches, camera_, diameter_, options_, random,
                               static_cast<uint32_t>(k));
    if (!pose) break;
    Detection detection =
        examine(picture, pose->T_camera_object, static_cast<int>(pose->inliers.size()));
    if (isProven(detection)) return detection;
    for (auto i = pose->inliers.rbegin(); i != pose->inliers.rend(); ++i)
      matches.erase(matches.begin() + *i);
  }
  return std::nullopt;
}

// The best of the candidates: another view of the object may be nearly as good.
std::optional<Detection> DatabaseDetector::Finder::findByEdges(const Picture& picture,
                                                               const ChamferMaps& maps) {
  const auto plausible = [&](const SE3& T) {
    return look(picture, T).value_or(1) >= options_.implausible_look;
  };
  const auto evidence = [](const Detection& d) { return d.health + d.look.value_or(0); };
  std::optional<Detection> best;
  for (const EdgeTemplates::Candidate& candidate : templates_->find(maps, plausible)) {
    const Detection detection = examine(picture, candidate.T_camera_object, 0);
    if (isProven(detection) && (!best || evidence(detection) > evidence(*best))) best = detection;
  }
  return best;
}

std::optional<double> DatabaseDetector::Finder::look(const Picture& picture, const SE3& T) const {
  return compareLooks(database_.looks, picture.means, camera_, T, model_.centre_object);
}

Detection DatabaseDetector::Finder::examine(const Picture& picture, const SE3& T_camera_object,
                                            int inliers) {
  const ObjectMeasurement measured = verifier_.examine(picture.frame, {T_camera_object});
  const SE3& T = measured.T_camera_object;
  return {T, measured.health, look(picture, T), inliers};
}

bool DatabaseDetector::Finder::isProven(const Detection& detection) const {
  if (detection.health < tracker_options_.claim_health) return false;
  if (!detection.look) return detection.health >= options_.min_plain_health;
  return detection.health + *detection.look >=
         (detection.inliers > 0 ? options_.min_feature_evidence : options_.min_evidence);
}

DatabaseDetector::DatabaseDetector(std::vector<DetectorObject> objects, Camera camera,
                                   std::shared_ptr<const RayQuery> rays, DetectorOptions options,
                                   TrackerOptions tracker_options)
    : camera_(std::move(camera)), options_(std::move(options)) {
  for (DetectorObject& object : objects) {
    if (object.database.mesh_sha256 != meshChecksum(object.model.mesh))
      throw InputError(SourcePlace{object.model.name}, "the database was made from another mesh",
                       "make it again with `diorama train`");
    finders_.push_back(std::make_unique<Finder>(std::move(object),
                                                static_cast<int>(finders_.size()), camera_, rays,
                                                options_, tracker_options));
  }
}

DatabaseDetector::~DatabaseDetector() = default;

std::vector<std::optional<Detection>> DatabaseDetector::detect(const Frame& frame,
                                                               std::span<const int> objects) {
  std::vector<std::optional<Detection>> detections(objects.size());
  if (frame.gray.width != camera_.width() || frame.gray.height != camera_.height())
    return detections;
  const Picture picture{frame, MeanImage(frame.gray)};
  std::map<FeatureKind, Features> features;
  std::optional<ChamferMaps> maps;
  for (size_t i = 0; i < objects.size(); ++i) {
    Finder& finder = *finders_[static_cast<size_t>(objects[i])];
    const auto [at, missing] = features.try_emplace(finder.kind());
    if (missing) at->second = extractFeatures(frame.gray, finder.kind(), options_.max_features);
    detections[i] = finder.findByFeatures(picture, at->second);
    if (detections[i] || !finder.hasTemplates()) continue;
    if (!maps) maps.emplace(frame.gray, options_.templates.chamfer);
    detections[i] = finder.findByEdges(picture, *maps);
  }
  return detections;
}

}  // namespace diorama
