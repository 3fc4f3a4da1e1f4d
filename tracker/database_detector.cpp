// The main path of the detection. For each object:
//
//   match      features of the image with those of the database
//   pose       RANSAC PnP, robust refinement over all inliers
//   verify     the edge tracker starts from the pose: do the edges in the image agree?
//   again      without the inliers, when they do not
#include "tracker/database_detector.h"

#include <algorithm>
#include <map>

#include "core/errors.h"
#include "tracker/feature_matcher.h"
#include "tracker/object_tracker.h"
#include "tracker/pose_ransac.h"

namespace diorama {

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
        matcher_(database_, options.same_place * diameter_),
        verifier_(std::move(object.model), camera, std::move(rays), index, tracker_options) {}

  FeatureKind kind() const { return database_.kind; }

  std::optional<Detection> find(const Frame& frame, const Features& features);

 private:
  std::vector<PointMatch> match(const Features& features) const;
  std::optional<Detection> verify(const Frame& frame, const RansacPose& pose);

  const DetectorOptions& options_;
  const Camera& camera_;
  const ObjectDatabase database_;
  const double diameter_;
  const int object_;
  const FeatureMatcher matcher_;
  EdgeTracker verifier_;
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

std::optional<Detection> DatabaseDetector::Finder::find(const Frame& frame,
                                                        const Features& features) {
  std::vector<PointMatch> matches = match(features);
  const Random random(static_cast<uint64_t>(object_), RandomStream::kDetector);
  for (int k = 0; k < options_.hypotheses; ++k) {
    const auto pose = findPose(matches, camera_, diameter_, options_, random,
                               static_cast<uint32_t>(k));
    if (!pose) break;
    if (auto detection = verify(frame, *pose)) return detection;
    for (auto i = pose->inliers.rbegin(); i != pose->inliers.rend(); ++i)
      matches.erase(matches.begin() + *i);
  }
  return std::nullopt;
}

std::optional<Detection> DatabaseDetector::Finder::verify(const Frame& frame,
                                                          const RansacPose& pose) {
  const ObjectMeasurement measured = verifier_.examine(frame, {pose.T_camera_object});
  const int inliers = static_cast<int>(pose.inliers.size());
  if (!measured.claimed) return std::nullopt;
  return Detection{measured.T_camera_object, measured.health, inliers};
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
  std::map<FeatureKind, Features> features;
  for (size_t i = 0; i < objects.size(); ++i) {
    Finder& finder = *finders_[static_cast<size_t>(objects[i])];
    const auto [at, missing] = features.try_emplace(finder.kind());
    if (missing) at->second = extractFeatures(frame.gray, finder.kind(), options_.max_features);
    detections[i] = finder.find(frame, at->second);
  }
  return detections;
}

}  // namespace diorama
