// The main path of the visual odometry. A frame, in track():
//
//   start          until there is a map: follow corners (initialisation, surface_start); told of
//                  when the objects have not contradicted it for some frames (start_trial)
//   align          motion from the last frame, by grey values around features (sparse_alignment)
//   reproject      find the map's points, one per cell, by their patches (reprojection)
//   refine         the pose from the points' pixels (pose_refinement)
//   assess         does the pose explain enough of what was found? (tracking_quality)
//   relocalise     when it does not: from images and objects like these (relocalisation)
//
// and in update(), behind it (mapping):
//
//   filter depths  of corners that are no points yet (depth_filter)
//   add keyframe   when the camera moved or features get few (keyframe_policy)
//   adjust         the newest keyframes, points and objects (bundle_adjustment)
//
// Poses inside are T_world_camera, the world being the camera frame of the first keyframe.
#include "vo/odometry.h"

#include <algorithm>

#include "vo/exposure.h"
#include "vo/initialisation.h"
#include "vo/mapping.h"
#include "vo/motion_model.h"
#include "vo/object_scale.h"
#include "vo/relocalisation.h"
#include "vo/reprojection.h"
#include "vo/sparse_alignment.h"
#include "vo/start_trial.h"
#include "vo/surface_start.h"
#include "vo/tracking_quality.h"
#include "vo/vague_scale.h"
#include "vo/whole_image.h"

namespace diorama {

using namespace vo;

namespace {

// Shutters are open for up to a half of the time between frames; a quarter of the motion is usual.
constexpr double kSharpMotionPx = 8;

int blurredLevels(const Camera& camera, const TrackedFrame& last, const TrackedFrame& now) {
  const double focal = 0.5 * (camera.fx() + camera.fy());
  const SE3 T = last.T_world_camera.inverse() * now.T_world_camera;
  const double median = depthRange(last).median_m;
  const double px = focal * (Eigen::AngleAxisd(T.rotation).angle() + T.translation.norm() / median);
  int levels = 0;
  for (double motion = px; motion > kSharpMotionPx && levels < 4; motion /= 2) ++levels;
  return levels;
}

// A motion whose length is not known is half a measurement.
constexpr double kHealthWithoutScale = 0.5;

}  // namespace

class VisualOdometry::Implementation {
 public:
  Implementation(Camera camera, VoOptions options, std::string source_name, ObjectSurfaces surfaces)
      : options_(options),
        camera_(std::move(camera)),
        source_(std::move(source_name)),
        surfaces_(std::move(surfaces)),
        initialisation_(camera_, options_),
        trial_(options_),
        exposure_(options_) {
    forgetMap();
  }

  std::optional<OdometryMeasurement> track(const Frame& frame);
  void leaveOut(std::span<const ObjectMeasurement> moving);
  void update(std::span<const ObjectMeasurement> objects);
  bool wantsObjects() const;

  bool started() const { return told_; }
  std::optional<SE3> locate(const std::string& object) const;
  const std::vector<OdometryEvent>& events() const { return events_; }
  const Map& map() const { return mapping_->map(); }

 private:
  enum class State { kStarting, kOnTrial, kTracking, kLost };

  std::optional<OdometryMeasurement> trackStart();
  TrackedFrame makeFrame(const Frame& frame) const;
  Assessment follow(TrackedFrame& frame);
  Assessment follow(TrackedFrame& frame, const SE3& T_last_now);
  Assessment locate(TrackedFrame& frame, const SE3& T_world_camera);
  OdometryMeasurement accept(TrackedFrame frame, const Assessment& assessment);
  OdometryMeasurement lose(const TrackedFrame& frame, const std::string& reason);
  OdometryMeasurement coast(int64_t timestamp_ns);
  void start(std::span<const ObjectMeasurement> objects);
  void judgeStart(std::span<const ObjectMeasurement> objects);
  void startAnew(const std::string& reason);
  void forgetMap();
  void findByObjects(std::span<const ObjectMeasurement> objects);
  void note(const std::string& event, double value, const std::string& reason) {
    events_.push_back({event, value, reason});
  }

  const VoOptions options_;
  const Camera camera_;
  const std::string source_;
  const ObjectSurfaces surfaces_;

  Initialisation initialisation_;
  StartTrial trial_;
  StartAttempt start_;
  std::optional<TrackingQuality> quality_;  // anew with each map
  std::optional<Mapping> mapping_;
  ExposureLearning exposure_;

  State state_ = State::kStarting;
  bool told_ = false;        // of a start
  TrackedFrame now_;         // the frame just tracked; when lost, its image alone counts
  TrackedFrame last_;        // the last frame with a good pose
  TrackedFrame seen_again_;  // when lost: a frame that objects have placed in the map
  SE3 T_world_now_;          // of the newest frame; when lost, where it is taken to be
  SE3 T_world_reported_;     // its pose as it was reported, before the map was corrected
  MotionModel motion_;
  SE3 velocity_;  // T_last_now of the last two good frames
  VagueScale vague_scale_;
  Vector6d correction_ = Vector6d::Zero();  // of the reported pose since, right tangent
  int64_t previous_ns_ = 0;
  int start_frames_ = 0, lost_frames_ = 0;
  std::vector<OdometryEvent> events_;
};

std::optional<OdometryMeasurement> VisualOdometry::Implementation::track(const Frame& frame) {
  events_.clear();
  now_ = makeFrame(frame);
  if (state_ == State::kStarting || state_ == State::kOnTrial) return trackStart();
  if (!now_.pyramid) return lose(now_, "the image has another size than the camera");
  if (state_ == State::kTracking) {
    const Assessment assessment = follow(now_);
    return assessment.good ? accept(now_, assessment) : lose(now_, assessment.reason);
  }
  const TrackedFrame& nearest = seen_again_.pyramid ? seen_again_ : last_;
  for (const SE3& T_world_camera : posesFromImages(camera_, now_, nearest, map(), options_)) {
    const Assessment assessment = locate(now_, T_world_camera);
    if (assessment.good) return accept(now_, assessment);
  }
  return lose(now_, "");
}

// Who was told of an earlier start hears that there is nothing to trust.
std::optional<OdometryMeasurement> VisualOdometry::Implementation::trackStart() {
  std::optional<OdometryMeasurement> m;
  if (state_ == State::kOnTrial) {
    const Assessment assessment = now_.pyramid ? follow(now_) : Assessment{};
    if (assessment.good)
      m = accept(now_, assessment);
    else
      startAnew("the map was lost at once");
  } else if (initialisation_.begun() && now_.pyramid) {
    initialisation_.follow(now_);
  }
  if (!told_) return std::nullopt;
  if (!m) return coast(now_.timestamp_ns);
  m->health = 0;
  return m;
}

TrackedFrame VisualOdometry::Implementation::makeFrame(const Frame& frame) const {
  TrackedFrame made;
  made.timestamp_ns = frame.timestamp_ns;
  if (frame.gray.width != camera_.width() || frame.gray.height != camera_.height()) return made;
  made.pyramid = std::make_shared<const ImagePyramid>(frame.gray, options_.pyramid_levels);
  made.noise = imageNoise(frame.gray);
  return made;
}

// Started with constant velocity; when that fails, from how the whole image has moved.
Assessment VisualOdometry::Implementation::follow(TrackedFrame& frame) {
  const Assessment assessment = follow(frame, velocity_);
  if (assessment.good) return assessment;
  const WholeImageMatch match = matchWholeImages(camera_, *last_.pyramid, *frame.pyramid);
  return follow(frame, match.T_current_reference.inverse());
}

// Motion from the last frame, then the pose in the map.
Assessment VisualOdometry::Implementation::follow(TrackedFrame& frame, const SE3& T_last_now) {
  const auto aligned =
      alignSparsely(camera_, last_, *frame.pyramid, T_last_now.inverse(), options_);
  frame.T_world_camera =
      last_.T_world_camera * (aligned ? aligned->T_current_reference.inverse() : T_last_now);
  frame.blurred_levels = blurredLevels(camera_, last_, frame);
  frame.exposure_share = exposure_.share();
  frame.T_before_now = last_.T_world_camera.inverse() * frame.T_world_camera;
  const ReprojectionResult reprojected = reprojectMap(camera_, map(), frame, options_);
  const PoseRefinement refined =
      refinePose(camera_, frame, options_, motion_.predict(frame.timestamp_ns));
  return quality_->assess(frame, reprojected, refined);
}

// The pose in the map from a coarse one; what was found first leads to more.
Assessment VisualOdometry::Implementation::locate(TrackedFrame& frame, const SE3& T_world_camera) {
  frame.T_world_camera = T_world_camera;
  ReprojectionResult reprojected = reprojectMap(camera_, map(), frame, options_);
  PoseRefinement refined = refinePose(camera_, frame, options_);
  reprojected = reprojectMap(camera_, map(), frame, options_);
  refined = refinePose(camera_, frame, options_);
  return quality_->assessRecovery(reprojected, refined);
}

OdometryMeasurement VisualOdometry::Implementation::accept(TrackedFrame frame,
                                                           const Assessment& assessment) {
  const bool recovered = state_ == State::kLost;
  OdometryMeasurement m{source_, last_.timestamp_ns, frame.timestamp_ns,
                        T_world_reported_.inverse() * frame.T_world_camera};
  m.covariance = stepCovariance(last_, frame, assessment.hessian, options_);
  const Vector6d correction =
      adjoint(frame.T_world_camera.inverse() * last_.T_world_camera) * correction_;
  m.covariance += correction * correction.transpose();
  m.covariance += vague_scale_.add(m.T_from_to, mapping_->scaleSigma());
  m.health = mapping_->isMetric() ? assessment.health : kHealthWithoutScale * assessment.health;
  if (!recovered) exposure_.learn(camera_, frame);
  judgePoints(frame, assessment.failed);
  frame.hidden = HiddenRegions(camera_, frame, assessment.failed);
  if (recovered) note("relocalised", lost_frames_, "found again in the map");

  velocity_ = recovered ? SE3{} : last_.T_world_camera.inverse() * frame.T_world_camera;
  if (recovered) motion_.forgetMotion();
  motion_.add(frame.timestamp_ns, frame.T_world_camera,
              certainFeatures(frame) >= options_.unsettled_below);
  correction_.setZero();
  T_world_reported_ = T_world_now_ = frame.T_world_camera;
  previous_ns_ = frame.timestamp_ns;
  last_ = std::move(frame);
  seen_again_ = {};
  lost_frames_ = 0;
  if (recovered) state_ = State::kTracking;
  return m;
}

// The camera is taken to go on as it did, and motion is measured from the last good pose when it is
// found again.
OdometryMeasurement VisualOdometry::Implementation::lose(const TrackedFrame& frame,
                                                         const std::string& reason) {
  if (state_ == State::kTracking) note("lost", 0, reason);
  state_ = State::kLost;
  ++lost_frames_;
  return coast(frame.timestamp_ns);
}

// Health 0.
OdometryMeasurement VisualOdometry::Implementation::coast(int64_t timestamp_ns) {
  OdometryMeasurement m{source_, previous_ns_, timestamp_ns,
                        motion_.coast(previous_ns_, timestamp_ns)};
  previous_ns_ = timestamp_ns;
  T_world_now_ = T_world_now_ * m.T_from_to;
  return m;
}

bool VisualOdometry::Implementation::wantsObjects() const {
  return state_ == State::kStarting || mapping_->wantsObjects(now_.timestamp_ns);
}

void VisualOdometry::Implementation::leaveOut(std::span<const ObjectMeasurement> moving) {
  if (moving.empty() || last_.timestamp_ns != now_.timestamp_ns) return;
  last_.moving = MovingObjects(camera_, surfaces_, moving);
  mapping_->leaveOutMoving(last_);
}

void VisualOdometry::Implementation::update(std::span<const ObjectMeasurement> objects) {
  if (!now_.pyramid) return;
  if (state_ == State::kStarting) return start(objects);
  if (state_ == State::kLost) return findByObjects(objects);
  const MapUpdate changed = mapping_->update(last_, motion_.strength().value_or(0), objects);
  if (changed.adjusted) {
    T_world_now_ = last_.T_world_camera;
    correction_ = log(T_world_reported_.inverse() * last_.T_world_camera);
    motion_.moveTo(last_.T_world_camera);
  }
  if (!changed.stretched_by.empty()) {
    velocity_.translation *= changed.stretched;
    motion_.stretch(changed.stretched);
    note("reinitialised", changed.stretched, "scale known now, from " + changed.stretched_by);
    vague_scale_.begin();
    trial_.begin();
  }
  judgeStart(objects);
}

// Where objects say that the camera is, the map should be seen. The next frame starts from there.
void VisualOdometry::Implementation::findByObjects(std::span<const ObjectMeasurement> objects) {
  for (const SE3& T_world_camera : posesFromObjects(objects, map()))
    if (locate(now_, T_world_camera).good) {
      seen_again_ = now_;
      return;
    }
}

std::optional<SE3> VisualOdometry::Implementation::locate(const std::string& object) const {
  for (const MapObject& known : map().objects)
    if (known.name == object) return T_world_now_.inverse() * known.T_world_object;
  return std::nullopt;
}

void VisualOdometry::Implementation::start(std::span<const ObjectMeasurement> objects) {
  const bool object_seen = std::any_of(objects.begin(), objects.end(), isUsable);
  if (!initialisation_.begun() || (object_seen && !initialisation_.sawObject()))
    return initialisation_.begin(now_, objects);
  const bool without_scale = ++start_frames_ >= options_.start_wait_frames;
  StartAttempt attempt = initialisation_.tryStart(now_, objects, without_scale, mapping_->map());
  std::string reason = attempt.started ? "" : initialisation_.hopeless();
  if (!attempt.started && reason.empty()) return;
  if (!attempt.started)
    attempt = startFromSurfaces(camera_, initialisation_, now_, objects, surfaces_, options_,
                                mapping_->map());
  if (!attempt.started) {
    if (!attempt.reason.empty()) reason += "; " + attempt.reason;
    note("reset", 0, "no start: " + reason);
    initialisation_.askForLess();
    return initialisation_.begin(now_, objects);
  }
  state_ = State::kOnTrial;
  start_ = attempt;
  trial_.begin();
  mapping_->begin(attempt.metric);
  initialisation_.clear();
  const Keyframe& keyframe = *map().keyframes.back();
  last_ = keyframe;
  T_world_now_ = keyframe.T_world_camera;
  T_world_reported_ = keyframe.T_world_camera;
  previous_ns_ = keyframe.timestamp_ns;
  judgeStart(objects);
}

// Without scale objects say nothing about a map. One that was right for some frames is no longer
// doubted: it may be an object that moves.
void VisualOdometry::Implementation::judgeStart(std::span<const ObjectMeasurement> objects) {
  const bool asked = mapping_->isMetric() && mapping_->wantsObjects(now_.timestamp_ns);
  if (asked && !trial_.over()) {
    trial_.add(discrepancy(map(), last_.T_world_camera, objects, options_));
    if (trial_.refuted()) {
      initialisation_.askForMore();
      return startAnew("objects contradict the map: does something move with the camera?");
    }
  }
  if (state_ != State::kOnTrial || (asked && !trial_.over())) return;
  state_ = State::kTracking;
  note(told_ ? "reinitialised" : "started", start_.points, start_.reason);
  told_ = true;
}

void VisualOdometry::Implementation::startAnew(const std::string& reason) {
  note(told_ ? "lost" : "reset", 0, "no start: " + reason);
  state_ = State::kStarting;
  forgetMap();
  initialisation_.begin(now_, {});
}

void VisualOdometry::Implementation::forgetMap() {
  last_ = seen_again_ = {};
  now_.features.clear();
  motion_ = {};
  velocity_ = {};
  correction_.setZero();
  quality_.emplace(options_);
  mapping_.emplace(camera_, options_);
  vague_scale_.begin();
  trial_.begin();
}

VisualOdometry::VisualOdometry(Camera camera, VoOptions options, std::string source_name,
                               KnownShapes shapes)
    : implementation_(std::make_unique<Implementation>(
          std::move(camera), options, std::move(source_name),
          ObjectSurfaces(std::move(shapes.rays), std::move(shapes.names)))) {}
VisualOdometry::~VisualOdometry() = default;

std::optional<OdometryMeasurement> VisualOdometry::track(const Frame& frame) {
  return implementation_->track(frame);
}
void VisualOdometry::leaveOut(std::span<const ObjectMeasurement> moving) {
  implementation_->leaveOut(moving);
}
void VisualOdometry::update(std::span<const ObjectMeasurement> objects) {
  implementation_->update(objects);
}
bool VisualOdometry::wantsObjects() const { return implementation_->wantsObjects(); }
std::optional<SE3> VisualOdometry::locate(const std::string& object) const {
  return implementation_->locate(object);
}
bool VisualOdometry::started() const { return implementation_->started(); }
std::vector<OdometryEvent> VisualOdometry::events() const { return implementation_->events(); }

std::vector<Vector3d> VisualOdometry::mapPoints() const {
  std::vector<Vector3d> points;
  for (const auto& point : implementation_->map().points)
    if (!point->bad && point->settled) points.push_back(point->p_world);
  return points;
}
int VisualOdometry::keyframeCount() const {
  return static_cast<int>(implementation_->map().keyframes.size());
}

}  // namespace diorama
