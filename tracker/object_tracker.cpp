// The main path of the tracker. A frame, in track():
//
//   predict        by the motion so far, or the given start; how sure that is counts in refine
//   expect         one narrow refine around the prediction: enough for what moves on as it did
//   align          else grey values of the last good frame, coarse to fine: carries large motions
//   filter         with several particles: each is moved, refined and weighted; their mean goes on
//   refine         rounds of {search edges along normals, robust Gauss-Newton with texture patches
//                  and the colours beside the outline}
//   assess         health: do the edges and the texture agree with the pose?
//   rescue         when they do not: screened random starts, aligned and refined; from a given
//                  start, annealed particles
//   remember       when they do: contrast of the edges, colours, reference pixels, keyframe of the
//                  patches
//
// Poses inside are T_camera_model, the model frame being the object frame moved to the box centre.
#include "tracker/object_tracker.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "tracker/edge_model.h"
#include "tracker/followed_motion.h"
#include "tracker/frame_alignment.h"
#include "tracker/image_pyramid.h"
#include "tracker/pose_refiner.h"
#include "tracker/start_search.h"
#include "tracker/track_report.h"

namespace diorama {
namespace {

// An object that is followed does not turn by so much from frame to frame.
constexpr double kLeap_rad = 0.35;

constexpr double kSmearing_px = 10;  // motion from frame to frame that may smear edges

}  // namespace

class EdgeTracker::Implementation {
 public:
  Implementation(ObjectModel object, Camera camera, std::shared_ptr<const RayQuery> rays,
                 int object_index, TrackerOptions options, std::string source_name);

  ObjectMeasurement track(const Frame& frame, const std::optional<ObjectPrediction>& start);
  ObjectMeasurement examine(const Frame& frame, const ObjectPrediction& start);

 private:
  enum class State { kWaiting, kStarting, kTracking, kDoubtful, kLost };

  std::string problemOf(const Frame& frame, const std::optional<ObjectPrediction>& start) const;
  bool isHeld() const { return state_ == State::kTracking || state_ == State::kDoubtful; }
  bool isNearLast(const Estimate& estimate, double distance_px) const {
    return refiner_.pixelMotion(estimate.T_camera_model, T_last_) < distance_px;
  }
  void begin(const SE3& T_camera_model);
  Estimate estimateFrom(const Frame& frame, const std::optional<ObjectPrediction>& start);
  double healthNeeded(const Estimate& estimate, const std::optional<ObjectPrediction>& start) const;
  bool improve(const Frame& frame, double needed, Estimate& estimate);
  Estimate follow(const Frame& frame);
  std::optional<Estimate> refineExpected(const std::optional<PosePrior>& expected);
  Estimate refineEither(const SE3& aligned, const SE3& predicted,
                        const std::optional<PosePrior>& expected);
  Estimate startAt(const SE3& start, const std::optional<PosePrior>& prior, const Frame& frame) {
    return searchFromStart(start, prior, static_cast<uint32_t>(frame.index), frames_.isGood(),
                           options_, refiner_, filter_);
  }
  void accept(const Estimate& estimate, int64_t timestamp_ns, bool good);
  ObjectMeasurement lose(const Frame& frame, const TrackHealth& health);

  const TrackerOptions options_;
  const Camera camera_;
  const std::shared_ptr<const RayQuery> rays_;
  const EdgeModel model_;
  const TrackReport report_;
  FrameAlignment frames_;
  PoseRefiner refiner_;
  ParticleFilter filter_;
  ImagePyramid image_;

  State state_ = State::kWaiting;
  SE3 T_last_;             // T_camera_model of the last frame that was not lost
  SE3 T_good_;             // ... of the last frame that was good, or as given
  int doubts_ = 0;         // frames in a row that were not good
  bool starting_ = false;  // no good frame since the last given start
  FollowedMotion motion_;  // since it is good
};

EdgeTracker::Implementation::Implementation(ObjectModel object, Camera camera,
                                            std::shared_ptr<const RayQuery> rays, int object_index,
                                            TrackerOptions options, std::string source_name)
    : options_(options),
      camera_(std::move(camera)),
      rays_(std::move(rays)),
      model_(makeEdgeModel(object.mesh, options_)),
      report_(std::move(source_name), object.name, model_.centre_object, options_),
      frames_(model_, camera_, *rays_, object_index, options_),
      refiner_(model_, object.mesh, camera_, *rays_, object_index, options_),
      filter_(options_.filter, options_.particles, static_cast<uint64_t>(options_.seed)) {
  if (model_.edges.empty())
    throw InputError(SourcePlace{object.name}, "the mesh has no edges that can be seen",
                     "give a mesh with faces of non-zero area");
}

std::string EdgeTracker::Implementation::problemOf(
    const Frame& frame, const std::optional<ObjectPrediction>& start) const {
  if (frame.gray.width != camera_.width() || frame.gray.height != camera_.height())
    return "the image has another size than the camera";
  if (start && !start->T_camera_object.isFinite()) return "the start is not finite";
  return "";
}

ObjectMeasurement EdgeTracker::Implementation::track(const Frame& frame,
                                                     const std::optional<ObjectPrediction>& start) {
  if (const std::string problem = problemOf(frame, start); !problem.empty())
    return report_.notClaimed(frame, T_last_, problem);
  if (start)
    begin(report_.toModel(start->T_camera_object));
  else if (state_ == State::kWaiting)
    return report_.notClaimed(frame, T_last_, "no pose to start from");
  image_.build(frame.gray);
  Estimate estimate = estimateFrom(frame, start);
  const double needed = healthNeeded(estimate, start);
  bool good = estimate.health.value >= needed || improve(frame, needed, estimate);
  // Several poses may explain the part that is seen of an object.
  if (good && isHeld() && !isCertain(kDoubted * estimate.covariance, options_) &&
      refiner_.coverAt(estimate.T_camera_model).any()) {
    estimate =
        refiner_.searchNeighbours(std::move(estimate), motion_.expectedAt(frame.timestamp_ns));
    good = estimate.health.value >= needed;
  }
  doubts_ = good ? 0 : doubts_ + 1;
  if (estimate.health.value < options_.lost_health || doubts_ > options_.doubtful_frames)
    return lose(frame, estimate.health);
  accept(estimate, frame.timestamp_ns, good);
  return report_.of(frame, estimate, good);
}

// The object may be elsewhere now: what it looked like still holds, how it moved does not.
void EdgeTracker::Implementation::begin(const SE3& T_camera_model) {
  motion_.stop();
  refiner_.setKnown(Matrix6d::Zero());
  T_last_ = T_good_ = T_camera_model;
  state_ = State::kStarting;
  doubts_ = 0;
  starting_ = true;
  filter_.stop();
}

Estimate EdgeTracker::Implementation::estimateFrom(const Frame& frame,
                                                   const std::optional<ObjectPrediction>& start) {
  // Where it is known to be, what looks otherwise is something that covers it.
  const bool verified = start && start->verified;
  const bool expected = start && isCertain(start->covariance, options_);
  refiner_.setImage(frame,
                    isHeld() || verified || expected ? Covers::kLeftOut : Covers::kAgainstPose);
  if (!starting_ && (state_ != State::kLost || frames_.isGood())) return follow(frame);
  // What other evidence there is for it counts; what is expected by this tracker's poses does not.
  const auto prior = start ? independentPrior(*start, model_) : std::nullopt;
  Estimate estimate = startAt(
      start
          ? T_last_
          : frames_.align(image_, motion_.predict(frame.timestamp_ns, T_last_), T_last_, refiner_),
      prior, frame);
  if (prior) refiner_.setKnown(prior->weightOf(estimate.T_camera_model) * prior->information);
  if (!expected || verified || isNearLast(estimate, options_.wide_search_px)) return estimate;
  // It is not there: a start as any other.
  refiner_.setImage(frame, Covers::kAgainstPose);
  return startAt(T_last_, std::nullopt, frame);
}

double EdgeTracker::Implementation::healthNeeded(
    const Estimate& estimate, const std::optional<ObjectPrediction>& start) const {
  const bool stayed = start && isNearLast(estimate, options_.wide_search_px);
  const bool leapt = angleBetween(estimate.T_camera_model.rotation, T_last_.rotation) > kLeap_rad;
  if (start ? start->verified && stayed : state_ == State::kTracking && !leapt)
    return options_.claim_health;
  // A start that the image leaves where it was is half confirmed already.
  return stayed ? options_.kept_health : options_.start_health;
}

// Of an estimate without the health needed: as of a smeared picture, among its neighbours, from
// random starts. Whether it is good then.
bool EdgeTracker::Implementation::improve(const Frame& frame, double needed, Estimate& estimate) {
  const bool held = isHeld();
  if (held && !isNearLast(estimate, kSmearing_px)) {
    Estimate smeared = refiner_.refineSmeared(estimate.T_camera_model, T_last_,
                                              motion_.expectedAt(frame.timestamp_ns));
    if (smeared.health.value > estimate.health.value) estimate = std::move(smeared);
    if (estimate.health.value >= needed) return true;
  }
  if (held) {
    Estimate neighbour = refiner_.searchNeighbours(estimate);
    if (neighbour.health.value >= needed) {
      estimate = std::move(neighbour);
      return true;
    }
  }
  if (!frames_.isGood()) return false;
  if (!held) refiner_.setImage(frame, Covers::kAgainstPose);  // it is sought anywhere now
  Estimate rescued =
      refiner_.refine(frames_.search(image_, motion_.predict(frame.timestamp_ns, T_last_), T_last_,
                                     static_cast<uint32_t>(frame.index)));
  if (rescued.health.value <= estimate.health.value) return false;
  estimate = std::move(rescued);
  return estimate.health.value >= options_.start_health;
}

// The pose of this frame from that of the last: by one hypothesis, or by the filter's mean.
Estimate EdgeTracker::Implementation::follow(const Frame& frame) {
  const std::optional<PosePrior> expected = motion_.expectedAt(frame.timestamp_ns);
  if (options_.particles == 1) {
    if (auto estimate = refineExpected(expected)) return *std::move(estimate);
    const SE3 predicted = motion_.predict(frame.timestamp_ns, T_last_);
    return refineEither(frames_.align(image_, predicted, T_last_, refiner_), predicted, expected);
  }
  const double seconds = motion_.secondsSince(frame.timestamp_ns);
  const uint32_t index = static_cast<uint32_t>(frame.index);
  if (!filter_.started()) filter_.start(T_last_);
  filter_.propagate(std::min(seconds, FollowedMotion::kLongestExtrapolation_s), index);
  const SE3 predicted = weightedMean(filter_.particles()).T;
  const SE3 aligned = frames_.align(image_, predicted, T_last_, refiner_);
  filter_.shift(predicted.inverse() * aligned);
  const std::vector<int> samples = refiner_.visibleSamples(aligned, options_.filter.max_samples);
  const std::vector<int> ranges(static_cast<size_t>(options_.filter.rounds),
                                options_.filter.search_px);
  // Where the particles lie in several valleys their mean may lie in none.
  Estimate alone = refineEither(aligned, predicted, expected);
  if (!filter_.update([&](const SE3& T) { return refiner_.judge(T, samples, ranges); }, seconds,
                      index))
    return alone;
  Estimate by_particles = refiner_.refine(filter_.mean().T, expected);
  return by_particles.health.value > alone.health.value ? by_particles : alone;
}

// What moves on as it did is found close to where it is expected, better than by its grey values.
std::optional<Estimate> EdgeTracker::Implementation::refineExpected(
    const std::optional<PosePrior>& expected) {
  if (!expected || refiner_.coverAt(expected->T_camera_model).any()) return std::nullopt;
  Estimate estimate =
      refiner_.refine(expected->T_camera_model, {options_.narrow_search_px}, expected);
  const double moved_px = refiner_.pixelMotion(expected->T_camera_model, estimate.T_camera_model);
  if (moved_px > options_.narrow_search_px || estimate.health.value < options_.start_health)
    return std::nullopt;
  return estimate;
}

// Grey values may have gone with something in front of the object: where they and the prediction do
// not agree, print and edges decide.
Estimate EdgeTracker::Implementation::refineEither(const SE3& aligned, const SE3& predicted,
                                                   const std::optional<PosePrior>& expected) {
  Estimate best = refiner_.refine(aligned, expected);
  if (!refiner_.coverAt(aligned).any() ||
      refiner_.pixelMotion(aligned, predicted) <= options_.narrow_search_px)
    return best;
  Estimate other = refiner_.refine(predicted, expected);
  return other.isSharperThan(best) ? other : best;
}

ObjectMeasurement EdgeTracker::Implementation::examine(const Frame& frame,
                                                       const ObjectPrediction& start) {
  if (const std::string problem = problemOf(frame, start); !problem.empty())
    return report_.notClaimed(frame, T_last_, problem);
  image_.build(frame.gray);
  refiner_.setImage(frame, Covers::kIgnored);
  const Estimate estimate =
      refiner_.refineStart(report_.toModel(start.T_camera_object), independentPrior(start, model_));
  return report_.of(frame, estimate, estimate.health.value >= options_.start_health);
}

// Holds the last good pose, the reference and the contrast: the object may reappear.
ObjectMeasurement EdgeTracker::Implementation::lose(const Frame& frame, const TrackHealth& health) {
  state_ = State::kLost;
  starting_ = starting_ && !frames_.isGood();  // later starts are not tried for ever
  T_last_ = T_good_;
  motion_.stop();
  refiner_.setKnown(Matrix6d::Zero());
  filter_.stop();
  ObjectMeasurement measurement = report_.notClaimed(
      frame, T_last_,
      "lost: " +
          (health.reason.empty() ? "hardly an edge agrees with any pose tried" : health.reason));
  measurement.health = health.value;
  return measurement;
}

void EdgeTracker::Implementation::accept(const Estimate& estimate, int64_t timestamp_ns,
                                         bool good) {
  motion_.learn(estimate, timestamp_ns, good);
  state_ = good ? State::kTracking : State::kDoubtful;
  T_last_ = estimate.T_camera_model;
  if (!good) {
    // An unconfirmed start is carried by its grey values, lest it drifts away before it is proven.
    if (starting_ && !frames_.isGood()) frames_.setReference(image_, T_last_, {}, false);
    return;
  }
  starting_ = false;
  T_good_ = T_last_;
  frames_.setReference(image_, T_good_, refiner_.coverAt(T_good_), true);

  // What is followed uncertainly, half covered, must not change what is known of the object.
  if (isCertain(estimate.covariance, options_)) refiner_.remember(estimate);
}

EdgeTracker::EdgeTracker(ObjectModel model, Camera camera, std::shared_ptr<const RayQuery> rays,
                         int object_index_in_ray_query, TrackerOptions options,
                         std::string source_name)
    : implementation_(std::make_unique<Implementation>(std::move(model), std::move(camera),
                                                       std::move(rays), object_index_in_ray_query,
                                                       options, std::move(source_name))) {}

EdgeTracker::~EdgeTracker() = default;

ObjectMeasurement EdgeTracker::examine(const Frame& frame, const ObjectPrediction& start) {
  return implementation_->examine(frame, start);
}

ObjectMeasurement EdgeTracker::track(const Frame& frame,
                                     const std::optional<ObjectPrediction>& start) {
  return implementation_->track(frame, start);
}

}  // namespace diorama
