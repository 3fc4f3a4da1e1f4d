// The main path of the detection. For each object:
//
//   match      features of the image, the smallest ones left out, with those of the database
//   pose       RANSAC PnP, robust refinement over all inliers
//   verify     the edge tracker starts from the pose: do the edges in the image agree, and does
//              the object look as it did in the training, or have its colours, if it is plain?
//   again      from the same pose moved to the image's edges; then without its inliers
//   templates  of its edges, where features do not find it: it is small, or has no texture
//   match      all features, where neither finds it
//   in part    where something straight hides the rest: templates again, then the poses found by
//              features
#include "tracker/database_detector.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "core/errors.h"
#include "tracker/edge_templates.h"
#include "tracker/feature_matcher.h"
#include "tracker/pose_ransac.h"
#include "tracker/pose_verifier.h"

namespace diorama {

namespace {
enum class Shown { kWhole, kPart };  // of the object
}

// A frame, and what is made of it once for all objects.
class DatabaseDetector::Picture {
 public:
  Picture(const Frame& f, const DetectorOptions& options) : frame(f), means(f), options_(options) {}

  const Frame& frame;
  const MeanImage means;

  const Features& features(FeatureKind kind, bool small) const {
    const auto [at, missing] = features_.try_emplace({kind, small});
    if (missing)
      at->second =
          (small ? extractFeatures : extractLargeFeatures)(frame.gray, kind, options_.max_features);
    return at->second;
  }
  EdgeTemplates::Sight sight(Shown shown = Shown::kWhole) const {
    if (!edges_) edges_.emplace(frame, options_.templates.chamfer);
    return {*edges_, means, shown == Shown::kPart ? std::optional(kUnseenCost) : std::nullopt};
  }

 private:
  const DetectorOptions& options_;
  mutable std::map<std::pair<FeatureKind, bool>, Features> features_;
  mutable std::optional<ChamferMaps> edges_;
};

namespace {

constexpr double kNextView = 0.25;  // rad, by which views of the templates differ

// The database's looks know the print, and every candidate would have to see its patches anew.
TrackerOptions withoutPrint(TrackerOptions options) {
  options.print_patches = 0;
  return options;
}

// What colour a mesh without materials has nobody knows.
ObjectDatabase withoutUnknownColors(DetectorObject& object) {
  ObjectDatabase database = std::move(object.database);
  if (arePlain(database.looks) && !object.model.mesh.hasMaterials()) database.looks.clear();
  return database;
}

}  // namespace

class DatabaseDetector::Finder {
 public:
  Finder(DetectorObject object, int index, const Camera& camera,
         std::shared_ptr<const RayQuery> rays, const DetectorOptions& options,
         const TrackerOptions& tracker_options)
      : options_(options),
        camera_(camera),
        database_(withoutUnknownColors(object)),
        diameter_(object.model.mesh.diameter()),
        object_(index),
        tracker_options_(withoutPrint(tracker_options)),
        rays_(std::move(rays)),
        model_(makeEdgeModel(object.model.mesh, tracker_options_)),
        matcher_(database_, options.same_place * diameter_),
        verifier_(object.model, model_, camera_, *rays_, index, tracker_options_, database_.looks,
                  options.look_points),
        symmetric_(object.model.symmetries.axis || !object.model.symmetries.discrete.empty()),
        templates_(model_, camera_, *rays_, index, tracker_options_, options_.templates,
                   database_.looks) {}

  std::optional<Detection> find(const Picture& picture);

 private:
  struct Hypothesis {
    std::vector<PointMatch> matches;
    RansacPose pose;  // with some of them
  };
  using Hypotheses = std::vector<Hypothesis>;
  std::optional<Detection> findByFeatures(const Picture& picture, bool small, Hypotheses& tried);
  std::optional<Detection> findInPart(const Picture& picture, const Hypotheses& tried);
  std::optional<ExaminedPose> confirm(const Picture& picture, const Hypothesis& hypothesis,
                                      Shown shown);
  using Places = std::vector<EdgeTemplates::Placed>;
  std::optional<Detection> findByEdges(const Picture& picture, const Places& places, Shown shown);
  std::vector<PointMatch> match(const Features& features) const;
  bool isRival(const SE3& a, const SE3& b) const;
  bool castsDoubt(const ExaminedPose& other, const ExaminedPose& found) const;
  SE3 turned(const SE3& T_camera_object, double angle_rad) const;
  ExaminedPose examine(const ObjectPrediction& start, Shown shown);
  ExaminedPose polish(const ExaminedPose& found);
  double evidence(const ExaminedPose& pose) const;
  bool isProven(const ExaminedPose& pose) const;
  bool isProvenAs(const ExaminedPose& pose, Shown shown) const;
  bool isProvenByFeatures(const Detection& detection, size_t closely, double share) const;

  const DetectorOptions& options_;
  const Camera& camera_;
  const ObjectDatabase database_;
  const double diameter_;
  const int object_;
  const TrackerOptions tracker_options_;
  const std::shared_ptr<const RayQuery> rays_;
  const EdgeModel model_;
  const FeatureMatcher matcher_;
  PoseVerifier verifier_;
  const bool symmetric_;
  const EdgeTemplates templates_;
};

std::optional<Detection> DatabaseDetector::Finder::find(const Picture& picture) {
  verifier_.setImage(picture.frame, picture.means);
  Hypotheses tried;
  std::optional<Detection> found = findByFeatures(picture, false, tried);
  if (found) return found;
  const Places places = templates_.place(picture.sight().edges);
  found = findByEdges(picture, places, Shown::kWhole);
  if (!found && options_.small_features) found = findByFeatures(picture, true, tried);
  if (found || verifier_.isPlain()) return found;
  found = findByEdges(picture, places, Shown::kPart);
  return found ? found : findInPart(picture, tried);
}

ExaminedPose DatabaseDetector::Finder::examine(const ObjectPrediction& start, Shown shown) {
  return shown == Shown::kPart ? verifier_.examinePart(start.T_camera_object)
                               : verifier_.examine(start);
}

ExaminedPose DatabaseDetector::Finder::polish(const ExaminedPose& found) {
  const bool by_features = found.inliers > 0;
  ExaminedPose polished = verifier_.polish(
      {found.T_camera_object, found.covariance, by_features, by_features}, found.part);
  polished.inliers = found.inliers;
  polished.covariance = found.covariance;
  return polished.rank() > found.rank() ? polished : found;
}

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
                                                                  bool small, Hypotheses& tried) {
  std::vector<PointMatch> matches = match(picture.features(database_.kind, small));
  const Random random(static_cast<uint64_t>(object_), RandomStream::kDetector);
  for (int k = 0; k < options_.hypotheses; ++k) {
    const auto pose =
        findPose(matches, camera_, diameter_, options_, random, static_cast<uint32_t>(k));
    if (!pose) break;
    tried.push_back({matches, *pose});
    if (const auto detection = confirm(picture, tried.back(), Shown::kWhole))
      return polish(*detection);
    for (auto i = pose->inliers.rbegin(); i != pose->inliers.rend(); ++i)
      matches.erase(matches.begin() + *i);
  }
  return std::nullopt;
}

std::optional<Detection> DatabaseDetector::Finder::findInPart(const Picture& picture,
                                                              const Hypotheses& tried) {
  for (const Hypothesis& hypothesis : tried)
    if (const auto detection = confirm(picture, hypothesis, Shown::kPart))
      return polish(*detection);
  return std::nullopt;
}

std::optional<ExaminedPose> DatabaseDetector::Finder::confirm(const Picture& picture,
                                                              const Hypothesis& hypothesis,
                                                              Shown shown) {
  const auto& [matches, pose] = hypothesis;
  const SE3& T = pose.T_camera_object;
  constexpr double kMost = 0.75;  // of the features, where only a part is seen
  std::optional<ExaminedPose> best;
  double best_score = 0;
  const auto tryFrom = [&](const ObjectPrediction& start) {
    ExaminedPose detection = examine(start, shown);
    const SE3& T_found = detection.T_camera_object;
    const auto agreeing = [&](double inlier_px) {
      return agreeingMatches(matches, camera_, T_found, inlier_px);
    };
    // The edges may have led astray: the features must still agree.
    const size_t loosely = agreeing(2 * options_.inlier_px).size();
    detection.inliers = static_cast<int>(loosely);
    if (2 * loosely < pose.inliers.size()) return;
    const size_t closely = agreeing(0.4 * options_.inlier_px).size();
    const double share = static_cast<double>(closely) / static_cast<double>(loosely);
    const bool proven = shown == Shown::kPart
                            ? share >= kMost && isProven(detection)
                            : isProven(detection) || isProvenByFeatures(detection, closely, share);
    if (!proven) return;
    const double score = evidence(detection) + share;
    if (best && score <= best_score) return;
    detection.covariance = covarianceByMatches(matches, agreeing(options_.inlier_px), camera_,
                                               T_found, options_.inlier_px);
    best = detection;
    best_score = score;
  };
  const auto isCertain = [&] { return best && evidence(*best) >= options_.certain_evidence; };
  const SE3 tilted = tiltedTheOtherWay(T, matches, pose.inliers);
  // What the edges do not know, the features do: how a tin is turned.
  for (const SE3& start : {T, tilted})
    if (!isCertain())
      tryFrom({start,
               covarianceByMatches(matches, pose.inliers, camera_, start, options_.inlier_px),
               false, true});
  for (const SE3& start : {T, tilted})
    if (!isCertain()) tryFrom({templates_.refine(start, picture.sight()).T_camera_object});
  if (best && !isCertain())
    for (const double angle : {-kNextView, kNextView})
      tryFrom({templates_.refine(turned(best->T_camera_object, angle), picture.sight())
                   .T_camera_object});
  return best;
}

// The best of the candidates: another view of the object may be nearly as good. Where one is,
// nothing is claimed.
std::optional<Detection> DatabaseDetector::Finder::findByEdges(const Picture& picture,
                                                               const Places& places, Shown shown) {
  std::vector<ExaminedPose> seen;
  const auto best = [&] {
    return *std::max_element(
        seen.begin(), seen.end(),
        [](const ExaminedPose& a, const ExaminedPose& b) { return a.rank() < b.rank(); });
  };
  const auto tryFrom = [&](const SE3& start) {
    const ExaminedPose pose = examine({start}, shown);
    if (isProvenAs(pose, shown)) seen.push_back(pose);
  };
  for (const EdgeTemplates::Candidate& candidate :
       templates_.choose(places, picture.sight(shown))) {
    const bool certain = !seen.empty() && evidence(best()) >= options_.certain_evidence;
    if (!certain || isRival(candidate.T_camera_object, best().T_camera_object))
      tryFrom(candidate.T_camera_object);
  }
  if (seen.empty()) return std::nullopt;
  if (symmetric_) return polish(best());
  constexpr double kQuarter = 0.5 * std::numbers::pi;  // what stands looks most like that
  const SE3 T = best().T_camera_object;
  for (const double angle : {-kNextView, kNextView, kQuarter, 2 * kQuarter, 3 * kQuarter})
    tryFrom(templates_.refine(turned(T, angle), picture.sight(shown)).T_camera_object);
  const ExaminedPose found = polish(best());
  if (std::any_of(seen.begin(), seen.end(),
                  [&](const ExaminedPose& other) { return castsDoubt(other, found); }))
    return std::nullopt;
  if (shown == Shown::kPart && !isProvenAs(found, shown)) return std::nullopt;
  return found;
}

bool DatabaseDetector::Finder::isProvenAs(const ExaminedPose& pose, Shown shown) const {
  return isProven(pose) &&
         (shown == Shown::kWhole || evidence(pose) >= options_.min_evidence + kMoreInPart);
}

// At about the same place, but turned.
bool DatabaseDetector::Finder::isRival(const SE3& a, const SE3& b) const {
  return (a.translation - b.translation).norm() < 0.5 * diameter_ &&
         angleBetween(a.rotation, b.rotation) > options_.neighbour_rad;
}

// Poses side by side share most of their edges, and what is wrong with them: of these a small lead
// tells the better one. Something round and plain is the same from all sides.
bool DatabaseDetector::Finder::castsDoubt(const ExaminedPose& other,
                                          const ExaminedPose& found) const {
  const double turned =
      angleBetween(other.T_camera_object.rotation, found.T_camera_object.rotation);
  const double lead = found.rank() - other.rank();
  const bool led = turned > options_.rival_rad
                       ? lead >= options_.min_lead
                       : turned <= options_.neighbour_rad || lead >= options_.min_neighbour_lead;
  return !led && !(verifier_.isPlain() &&
                   templates_.areDrawnAlike(other.T_camera_object, found.T_camera_object));
}

// About the axis that points upwards.
SE3 DatabaseDetector::Finder::turned(const SE3& T_camera_object, double angle_rad) const {
  const SE3 to_centre{Eigen::Quaterniond::Identity(), model_.centre_object};
  const SE3 turn{Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Vector3d::UnitZ())),
                 Vector3d::Zero()};
  return T_camera_object * to_centre * turn * to_centre.inverse();
}

double DatabaseDetector::Finder::evidence(const ExaminedPose& pose) const {
  constexpr double kUsualFit = 0.5;
  double sum = pose.health + pose.look.value_or(0) - kUnseenCost * (1 - pose.seen_share);
  if (verifier_.isPlain() && pose.look) sum += pose.fit - kUsualFit;
  if (pose.inliers > 0) return sum;
  const double size_px = camera_.fx() * diameter_ / pose.T_camera_object.translation.z();
  return sum * std::cbrt(std::min(1.0, size_px / options_.full_size_px));
}

bool DatabaseDetector::Finder::isProven(const ExaminedPose& pose) const {
  if (pose.health < options_.min_health) return false;
  if (!pose.look) return verifier_.isPlain() && evidence(pose) >= options_.min_plain_health;
  return evidence(pose) >=
         (pose.inliers > 0 ? options_.min_feature_evidence : options_.min_evidence);
}

// Of an object half hidden half of the edges and looks are those of what hides it. But features of
// something else do not all agree to a fraction of their search with one pose.
bool DatabaseDetector::Finder::isProvenByFeatures(const Detection& detection, size_t closely,
                                                  double share) const {
  constexpr double kAlmostAll = 0.85;
  return closely >= static_cast<size_t>(options_.proving_features) && share >= kAlmostAll &&
         detection.health >= options_.min_hidden_health;
}

DatabaseDetector::DatabaseDetector(std::vector<DetectorObject> objects, Camera camera,
                                   std::shared_ptr<const RayQuery> rays, DetectorOptions options,
                                   TrackerOptions tracker_options)
    : camera_(std::move(camera)), options_(std::move(options)) {
  for (DetectorObject& object : objects) {
    if (object.database.mesh_sha256 != meshChecksum(object.model.mesh))
      throw InputError(SourcePlace{object.model.name},
                       "the database was made from another mesh, scale or axis",
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
  const Picture picture(frame, options_);
  for (size_t i = 0; i < objects.size(); ++i)
    detections[i] = finders_[static_cast<size_t>(objects[i])]->find(picture);
  return detections;
}

}  // namespace diorama
