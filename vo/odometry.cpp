// The main path of the visual odometry. A frame, in track():
//
//   start          until there is a map that may be told of (start)
//   align          motion from the last frame, by grey values around features (sparse_alignment)
//   reproject      find the map's points, one per cell, by their patches (reprojection)
//   refine         the pose from the points' pixels (pose_refinement)
//   assess         does the pose explain enough of what was found? (tracking_quality)
//   relocalise     when it does not: from images and objects like these (relocalisation)
//   report         the step from the last frame, and how exact it is (motion_report)
//
// and in update(), behind it (mapping):
//
//   filter depths  of corners that are no points yet (depth_filter)
//   add keyframe   when the camera moved or features get few (keyframe_policy)
//   adjust         the newest keyframes, points and objects (bundle_adjustment)
//
// Poses inside are T_world_camera, the world being the camera frame of the first keyframe.
#include "vo/odometry.h"

#include "vo/exposure.h"
#include "vo/mapping.h"
#include "vo/motion_report.h"
#include "vo/relocalisation.h"
#include "vo/reprojection.h"
#include "vo/sparse_alignment.h"
#include "vo/start.h"
#include "vo/tracking_quality.h"
#include "vo/whole_image.h"

namespace diorama {

using namespace vo;

namespace {

// A motion whose length is not known is half a measurement.
constexpr double kHealthWithoutScale = 0.5;

}  // namespace

class VisualOdometry::Implementation {
 public:
  Implementation(Camera camera, VoOptions options, std::string source_name, ObjectSurfaces surfaces)
      : options_(options),
        camera_(std::move(camera)),
        surfaces_(std::move(surfaces)),
        start_(camera_, options_, surfaces_),
        exposure_(options_),
        report_(std::move(source_name), options_) {
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
  Assessment follow(TrackedFrame& frame);
  Assessment follow(TrackedFrame& frame, const SE3& T_last_now);
  Assessment relocalise(const std::vector<SE3>& poses);
  OdometryMeasurement accept(TrackedFrame frame, const Assessment& assessment);
  OdometryMeasurement lose(const std::string& reason);
  void start(std::span<const ObjectMeasurement> objects);
  void judgeStart(std::span<const ObjectMeasurement> objects);
  void startAnew(const std::string& reason);
  void forgetMap();
  void note(const std::string& event, double value, const std::string& reason) {
    events_.push_back({event, value, reason});
  }

  const VoOptions options_;
  const Camera camera_;
  const ObjectSurfaces surfaces_;

  Start start_;
  std::optional<TrackingQuality> quality_;  // anew with each map
  std::optional<Mapping> mapping_;
  ExposureLearning exposure_;
  MotionReport report_;

  State state_ = State::kStarting;
  bool told_ = false;        // of a start
  TrackedFrame now_;         // the frame just tracked; when lost, its image alone counts
  TrackedFrame last_;        // the last frame with a good pose
  TrackedFrame seen_again_;  // when lost: a frame that objects have placed in the map
  MotionModel motion_;
  SE3 velocity_;  // T_last_now of the last two good frames
  int lost_frames_ = 0;
  std::vector<OdometryEvent> events_;
};

std::optional<OdometryMeasurement> VisualOdometry::Implementation::track(const Frame& frame) {
  events_.clear();
  now_ = makeFrame(frame, camera_, options_);
  if (state_ == State::kStarting || state_ == State::kOnTrial) return trackStart();
  if (!now_.pyramid) return lose("the image has another size than the camera");
  if (state_ == State::kTracking) {
    const Assessment assessment = follow(now_);
    return assessment.good ? accept(now_, assessment) : lose(assessment.reason);
  }
  const TrackedFrame& nearest = seen_again_.pyramid ? seen_again_ : last_;
  const Assessment assessment =
      relocalise(posesFromImages(camera_, now_, nearest, map(), options_));
  return assessment.good ? accept(now_, assessment) : lose(assessment.reason);
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
  } else {
    start_.follow(now_);
  }
  if (!told_) return std::nullopt;
  if (!m) return report_.coast(now_.timestamp_ns, motion_);
  m->health = 0;
  return m;
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

Assessment VisualOdometry::Implementation::relocalise(const std::vector<SE3>& poses) {
  return findInMap(camera_, map(), poses, *quality_, options_, now_);
}

OdometryMeasurement VisualOdometry::Implementation::accept(TrackedFrame frame,
                                                           const Assessment& assessment) {
  const bool recovered = state_ == State::kLost;
  frame.scale_variance = scaleVariance(frame, last_);
  OdometryMeasurement m = report_.step(last_, frame, assessment.hessian, mapping_->scaleSigma());
  m.health = assessment.health * (mapping_->isMetric() ? 1 : kHealthWithoutScale);
  if (!recovered) exposure_.learn(camera_, frame);
  judgePoints(frame, assessment.failed);
  frame.hidden = HiddenRegions(camera_, frame, assessment.failed);
  if (recovered) note("relocalised", lost_frames_, "found again in the map");

  velocity_ = recovered ? SE3{} : last_.T_world_camera.inverse() * frame.T_world_camera;
  if (recovered) motion_.forgetMotion();
  motion_.add(frame.timestamp_ns, frame.T_world_camera,
              certainFeatures(frame) >= options_.unsettled_below);
  last_ = std::move(frame);
  seen_again_ = {};
  lost_frames_ = 0;
  if (recovered) state_ = State::kTracking;
  return m;
}

// The camera is taken to go on as it did, and motion is measured from the last good pose when it is
// found again.
OdometryMeasurement VisualOdometry::Implementation::lose(const std::string& reason) {
  if (state_ == State::kTracking) note("lost", 0, reason);
  state_ = State::kLost;
  ++lost_frames_;
  return report_.coast(now_.timestamp_ns, motion_);
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
  if (state_ == State::kLost) {
    // Where objects say that the camera is, the map should be seen: the next frame starts there.
    if (relocalise(posesFromObjects(objects, map())).good) seen_again_ = now_;
    return;
  }
  const MapUpdate changed = mapping_->update(last_, motion_.strength().value_or(0), objects);
  if (changed.adjusted) {
    report_.correct(last_.T_world_camera);
    motion_.moveTo(last_.T_world_camera);
  }
  if (!changed.stretched_by.empty()) {
    velocity_.translation *= changed.stretched;
    motion_.stretch(changed.stretched);
    note("reinitialised", changed.stretched, "scale known now, from " + changed.stretched_by);
    report_.stretch();
    start_.beginTrial();
  }
  judgeStart(objects);
}

std::optional<SE3> VisualOdometry::Implementation::locate(const std::string& object) const {
  for (const MapObject& known : map().objects)
    if (known.name == object) return report_.pose().inverse() * known.T_world_object;
  return std::nullopt;
}

void VisualOdometry::Implementation::start(std::span<const ObjectMeasurement> objects) {
  const StartAttempt attempt = start_.attempt(now_, objects, mapping_->map());
  if (!attempt.reason.empty() && !attempt.started) note("reset", 0, "no start: " + attempt.reason);
  if (!attempt.started) return;
  state_ = State::kOnTrial;
  mapping_->begin(attempt.metric);
  last_ = *map().keyframes.back();
  report_.begin(last_.timestamp_ns, last_.T_world_camera);
  judgeStart(objects);
}

// Without scale objects say nothing about a map.
void VisualOdometry::Implementation::judgeStart(std::span<const ObjectMeasurement> objects) {
  const bool asked = mapping_->isMetric() && mapping_->wantsObjects(now_.timestamp_ns);
  const Verdict verdict = start_.judge(map(), last_.T_world_camera, objects, asked);
  if (verdict == Verdict::kRefuted)
    return startAnew("objects contradict the map: does something move with the camera?");
  if (state_ != State::kOnTrial || verdict == Verdict::kOpen) return;
  state_ = State::kTracking;
  note(told_ ? "reinitialised" : "started", start_.successful().points, start_.successful().reason);
  told_ = true;
}

void VisualOdometry::Implementation::startAnew(const std::string& reason) {
  note(told_ ? "lost" : "reset", 0, "no start: " + reason);
  state_ = State::kStarting;
  forgetMap();
  start_.beginAnew(now_);
}

void VisualOdometry::Implementation::forgetMap() {
  last_ = seen_again_ = {};
  now_.features.clear();
  motion_ = {};
  velocity_ = {};
  quality_.emplace(options_);
  mapping_.emplace(camera_, options_);
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
  return settledPoints(implementation_->map());
}
int VisualOdometry::keyframeCount() const {
  return static_cast<int>(implementation_->map().keyframes.size());
}

}  // namespace diorama
