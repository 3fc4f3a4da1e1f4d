#include "app/map_stage.h"

#include <algorithm>

#include "app/stopwatch.h"
#include "core/errors.h"

namespace diorama {

MapStage::MapStage(Method method, const std::vector<PipelineObject>& objects,
                   const MapperOptions& mapper_options, const PipelineOptions& options)
    : method_(method), options_(options), counters_(objects.size()), mapper_(mapper_options) {
  for (const PipelineObject& object : objects) {
    names_.push_back(object.name);
    mapper_.setSymmetries(object.name, object.symmetries);
  }
}

void MapStage::take(Message message) {
  std::visit([this](auto& said) { receive(std::move(said)); }, message);
}

// Stages may be at different frames.
MapStage::OpenFrame& MapStage::frameAt(int64_t timestamp_ns) {
  auto after = open_.end();
  while (after != open_.begin() && (after - 1)->result.timestamp_ns > timestamp_ns) --after;
  if (after != open_.begin() && (after - 1)->result.timestamp_ns == timestamp_ns)
    return *(after - 1);
  OpenFrame frame;
  frame.result.timestamp_ns = timestamp_ns;
  frame.result.objects.resize(names_.size());
  frame.waiting.resize(names_.size());
  frame.excused.resize(names_.size());
  frame.sightings_left = names_.size();
  frame.settled = method_ == Method::kEbt;
  return *open_.insert(after, std::move(frame));
}

void MapStage::receive(CameraStep step) {
  OpenFrame& frame = frameAt(step.timestamp_ns);
  FrameResult& result = frame.result;
  result.odometry_ms += step.ms;
  T_world_camera_ = step.T_world_camera;
  wants_objects_ = step.wants_objects;
  if (step.started) follow({step.timestamp_ns, step.T_world_camera});
  if (method_ == Method::kFused) moveMap(step, result);
  frame.by_map = mapper_.started();
  newest_ns_ = step.timestamp_ns;
  result.odometry = std::move(step.measurement);
}

void MapStage::follow(const StampedPose& camera) {
  std::vector<StampedPose>& poses = path_.poses;
  if (!poses.empty() && poses.back().timestamp_ns >= camera.timestamp_ns) return;
  if (mapper_.started()) poses.clear();  // it knows the older ones better
  poses.push_back(camera);
}

void MapStage::moveMap(const CameraStep& step, FrameResult& result) {
  if (!mapper_.started()) return;
  AddResult added{false, "the odometry gave nothing"};
  if (step.measurement) added = mapper_.addOdometry(*step.measurement);
  if (!added) DIORAMA_CHECK(mapper_.addGap(step.timestamp_ns, step.guess));
  if (!added && !odometry_gap_ && step.started && !step.explained)
    result.events.push_back({step.timestamp_ns, "odometry", "lost", 0, added.reason});
  odometry_gap_ = !added;
  dirty_ = true;
}

void MapStage::receive(CameraUpdate update) {
  OpenFrame& frame = frameAt(update.timestamp_ns);
  for (const OdometryEvent& event : update.events)
    frame.result.events.push_back(
        {update.timestamp_ns, "odometry", event.event, event.value, event.reason});
  for (size_t i = 0; i < names_.size(); ++i)
    counters_[i].T_camera_object = update.T_camera_object[i];
  if (update.started) {
    frame.result.T_world_camera = update.T_world_camera;
    follow({update.timestamp_ns, update.T_world_camera});
  }
  frame.result.odometry_ms += update.ms;
  if (!first_ns_) first_ns_ = update.timestamp_ns;
  if (method_ == Method::kFused) frame.by_map = startMap(update.timestamp_ns, update.started);
  settle(frame);
}

void MapStage::receive(Sighting sighting) {
  OpenFrame& frame = frameAt(sighting.timestamp_ns);
  FrameResult& result = frame.result;
  std::move(sighting.events.begin(), sighting.events.end(), std::back_inserter(result.events));
  sighting.events.clear();
  result.tracker_ms += sighting.ms;
  result.objects[sighting.object].measurement = sighting.measurement;
  --frame.sightings_left;
  if (frame.settled || frame.by_map)
    apply(frame, sighting);
  else
    frame.waiting[sighting.object] = std::move(sighting);
}

void MapStage::receive(const Drop& drop) {
  OpenFrame& frame = frameAt(drop.timestamp_ns);
  frame.result.dropped = true;
  frame.result.events.push_back({drop.timestamp_ns, drop.object ? names_[*drop.object] : "odometry",
                                 "dropped", 0, "behind: newer frames are waiting"});
  if (drop.object) {
    --frame.sightings_left;
    frame.excused[*drop.object] = true;
    return;
  }
  frame.without_camera = true;
  frame.by_map = method_ == Method::kFused && mapper_.started();
  settle(frame);
}

// The map's world is the camera frame in which the odometry starts. Before, the objects alone would
// tell where the camera is, and what is learnt of that later would go on moving the world.
bool MapStage::startMap(int64_t timestamp_ns, bool odometry_started) {
  if (mapper_.started()) return true;
  const double waited_s = 1e-9 * static_cast<double>(timestamp_ns - *first_ns_);
  if (!odometry_started && waited_s < options_.odometry_wait_s) return false;
  mapper_.start(timestamp_ns);
  return true;
}

// The camera is done with the frame.
void MapStage::settle(OpenFrame& frame) {
  const Stopwatch watch;
  frame.settled = true;
  for (std::optional<Sighting>& sighting : frame.waiting)
    if (sighting) apply(frame, *std::exchange(sighting, std::nullopt));
  if (frame.by_map) mapper_.update();
  dirty_ = false;
  report(frame);
  if (frame.by_map) frame.result.mapper_ms += watch.ms();
}

void MapStage::update() {
  if (!dirty_ || !mapper_.started()) return;
  mapper_.update();
  dirty_ = false;
}

void MapStage::apply(OpenFrame& frame, const Sighting& sighting) {
  Counter& counter = counters_[sighting.object];
  counter.begun = counter.begun || sighting.start;
  if (method_ == Method::kVo && sighting.start) place(*sighting.start, counter);
  if (sighting.doubt) mapper_.doubt(names_[sighting.object]);
  if (!sighting.measurement) return;
  const ObjectMeasurement& measurement = *sighting.measurement;
  if (!frame.by_map) {
    if (!measurement.claimed) return;
    noteHeard(frame, sighting.object);
    if (method_ != Method::kVo)
      frame.result.objects[sighting.object].T_camera_object = measurement.T_camera_object;
    return;
  }
  if (!measurement.claimed)
    counter.rejected = 0;
  else if (frame.without_camera)
    frame.excused[sighting.object] = true;  // no pose at that time, to which it could be added
  else
    addToMap(frame, sighting.object, measurement);
}

void MapStage::addToMap(OpenFrame& frame, size_t object, const ObjectMeasurement& measurement) {
  const AddResult added = mapper_.addObject(measurement);
  dirty_ = true;
  if (!added.decision.empty())
    frame.result.events.push_back({measurement.timestamp_ns, measurement.object, added.decision,
                                   added.innovation.value_or(0), added.reason});
  if (added) return noteHeard(frame, object);
  ++counters_[object].rejected;
  frame.result.events.push_back({measurement.timestamp_ns, measurement.object, "rejected",
                                 added.innovation.value_or(0), added.reason});
}

void MapStage::place(const StampedPose& start, Counter& counter) const {
  if (const StampedPose* camera = path_.nearest(start.timestamp_ns, 0))
    counter.T_world_object = camera->pose * start.pose;
}

void MapStage::noteHeard(OpenFrame& frame, size_t object) {
  Counter& counter = counters_[object];
  counter.rejected = counter.missed_frames = 0;
  counter.heard_ns = std::max(counter.heard_ns.value_or(0), frame.result.timestamp_ns);
  counter.overdue = false;
  frame.excused[object] = true;
}

// Counts the frames without a word of an object (the counter of Algorithm 1).
void MapStage::noteAbsences(OpenFrame& frame) {
  const int64_t now_ns = frame.result.timestamp_ns;
  for (size_t i = 0; i < counters_.size(); ++i) {
    Counter& counter = counters_[i];
    if (!counter.heard_ns) counter.heard_ns = now_ns;
    if (frame.excused[i]) continue;
    ++counter.missed_frames;
    const double silent_s = 1e-9 * static_cast<double>(now_ns - *counter.heard_ns);
    const bool overdue = counter.missed_frames >= options_.redetect_after_frames ||
                         silent_s >= options_.redetect_after_s;
    if (overdue && !counter.overdue && method_ == Method::kFused && counter.begun)
      frame.result.events.push_back(
          {now_ns, names_[i], "lost", static_cast<double>(counter.missed_frames),
           "the graph has not heard of it for too long: looked for anew"});
    counter.overdue = overdue;
  }
}

std::vector<FrameResult> MapStage::finished() {
  std::vector<FrameResult> results;
  while (!open_.empty() && open_.front().settled && open_.front().sightings_left == 0) {
    noteAbsences(open_.front());
    results.push_back(std::move(open_.front().result));
    open_.pop_front();
  }
  return results;
}

Guidance MapStage::standing(size_t object) const {
  const Counter& counter = counters_[object];
  Guidance guidance;
  if (method_ == Method::kVo) {
    guidance.track = wants_objects_;
    guidance.placed = !wants_objects_ && carriedByOdometry(counter);
  }
  guidance.rejected = counter.rejected;
  guidance.missed_frames = counter.missed_frames;
  guidance.overdue = counter.overdue;
  guidance.moving = method_ == Method::kFused && mapper_.isMoving(names_[object]);
  return guidance;
}

Guidance MapStage::guide(size_t object, int64_t timestamp_ns) const {
  Guidance guidance = standing(object);
  if (method_ != Method::kFused) return guidance;
  if (const auto prediction = mapper_.predict(names_[object]))
    guidance.prediction = motion_.carry(*prediction, newest_ns_, timestamp_ns);
  return guidance;
}

// Where the odometry has placed the object itself, or else where its start put it.
std::optional<SE3> MapStage::carriedByOdometry(const Counter& counter) const {
  if (counter.T_camera_object) return counter.T_camera_object;
  if (!counter.T_world_object) return std::nullopt;
  return T_world_camera_.inverse() * *counter.T_world_object;
}

void MapStage::report(OpenFrame& frame) {
  FrameResult& result = frame.result;
  const MapEstimate map = frame.by_map ? mapper_.estimate() : MapEstimate{};
  if (frame.by_map) result.T_world_camera = map.T_world_camera;
  if (frame.by_map && !path_.poses.empty() &&
      path_.poses.back().timestamp_ns == result.timestamp_ns)
    result.T_world_odometry = map.T_world_camera * path_.poses.back().pose.inverse();
  if (frame.without_camera && motion_.known())
    result.T_world_camera = motion_.at(result.timestamp_ns);
  else if (result.T_world_camera)
    motion_.add(result.timestamp_ns, *result.T_world_camera);
  for (size_t i = 0; i < names_.size(); ++i) {
    if (method_ == Method::kVo) result.objects[i].T_camera_object = carriedByOdometry(counters_[i]);
    if (const auto view = frame.by_map ? mapper_.view(names_[i]) : std::nullopt)
      result.objects[i].T_camera_object =
          result.T_world_camera->inverse() * map.T_world_camera * view->T_camera_object;
  }
}

FinalEstimate MapStage::finish() {
  if (method_ == Method::kFused && mapper_.started()) {
    MapEstimate map = mapper_.finish();
    return {mapper_.smoothedTrajectory(), std::move(map)};
  }
  FinalEstimate final{path_, {newest_ns_, T_world_camera_, {}}};
  if (method_ == Method::kVo)
    for (size_t i = 0; i < names_.size(); ++i)
      if (const auto T_camera_object = carriedByOdometry(counters_[i]))
        final.map.objects.push_back({names_[i], T_world_camera_ * *T_camera_object});
  return final;
}

}  // namespace diorama
