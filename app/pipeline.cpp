#include "app/pipeline.h"

#include <algorithm>

#include "app/stopwatch.h"

namespace diorama {

Pipeline::Pipeline(Method method, std::vector<PipelineObject> objects,
                   std::unique_ptr<Odometry> odometry, const MapperOptions& mapper_options,
                   std::unique_ptr<ObjectDetector> detector, const PipelineOptions& options)
    : method_(method),
      odometry_(std::move(odometry)),
      mapper_(mapper_options),
      detector_(std::move(detector)),
      options_(options) {
  for (PipelineObject& object : objects) {
    DIORAMA_CHECK(detector_ || object.initial_T_camera_object);
    objects_.push_back({std::move(object)});
  }
}

FrameResult Pipeline::process(const Frame& frame) {
  FrameResult result;
  now_ns_ = frame.timestamp_ns;
  if (method_ != Method::kEbt) moveCamera(frame, result);
  measureObjects(frame, result);
  if (method_ != Method::kEbt) informOdometry(result);
  if (method_ == Method::kFused) updateMap(result);
  reportObjects(result);
  started_ = true;
  return result;
}

void Pipeline::moveCamera(const Frame& frame, FrameResult& result) {
  const Stopwatch watch;
  result.odometry = odometry_->track(frame);
  result.odometry_ms = watch.ms();
  if (result.odometry)
    T_world_camera_ = poseAt(result.odometry->from_ns) * result.odometry->T_from_to;
  if (method_ == Method::kFused) moveMap(result);
}

// Of the camera by odometry alone; the newest one when there is none at that time.
SE3 Pipeline::poseAt(int64_t timestamp_ns) const {
  for (auto pose = camera_.poses.rbegin(); pose != camera_.poses.rend(); ++pose)
    if (pose->timestamp_ns == timestamp_ns) return pose->pose;
  return T_world_camera_;
}

void Pipeline::moveMap(FrameResult& result) {
  if (!started_) {
    mapper_.start(now_ns_);
    return;
  }
  AddResult added{false, "the odometry gave nothing"};
  if (result.odometry) added = mapper_.addOdometry(*result.odometry);
  if (!added) DIORAMA_CHECK(mapper_.addGap(now_ns_));
  if (!added && !odometry_gap_ && odometry_->started() && odometry_->events().empty())
    result.events.push_back({now_ns_, "odometry", "lost", 0, added.reason});
  odometry_gap_ = !added;
}

void Pipeline::informOdometry(FrameResult& result) {
  const Stopwatch watch;
  std::vector<ObjectMeasurement> objects;
  for (const ObjectResult& object : result.objects)
    if (object.measurement) objects.push_back(*object.measurement);
  odometry_->update(objects);
  for (const OdometryEvent& event : odometry_->events())
    result.events.push_back({now_ns_, "odometry", event.event, event.value, event.reason});
  if (odometry_->started()) {
    result.T_world_camera = T_world_camera_;
    camera_.poses.push_back({now_ns_, T_world_camera_});
  }
  result.odometry_ms += watch.ms();
}

// In fused, the graph's idea of an object that the tracker does not hold.
std::optional<ObjectPrediction> Pipeline::predict(const Object& object) const {
  if (method_ != Method::kFused || !object.begun || object.claimed) return std::nullopt;
  return mapper_.predict(object.parts.name);
}

// In vo: where the odometry has placed the object itself, or else where its start put it.
std::optional<SE3> Pipeline::carriedByOdometry(const Object& object) const {
  if (const auto located = odometry_->locate(object.parts.name)) return located;
  if (!object.T_world_object) return std::nullopt;
  return T_world_camera_.inverse() * *object.T_world_object;
}

// Whether an object without a prediction, or with one that has led to nothing for long, is to be
// looked for in this frame.
bool Pipeline::isWanted(const Object& object) const {
  if (!detector_ || object.claimed) return false;
  if (method_ == Method::kVo && !odometry_->wantsObjects() && carriedByOdometry(object))
    return false;  // placed once
  const bool due = object.unclaimed_frames % options_.search_every_frames == 0;
  return due && (object.unclaimed_frames >= options_.redetect_after_frames || !predict(object));
}

// The initial pose in the first frame; in fused, the graph's prediction after a frame in which the
// tracker did not hold the object; what the detector finds of those that are wanted; otherwise
// nothing: the tracker goes on by itself.
Pipeline::Starts Pipeline::findStarts(const Frame& frame, FrameResult& result) {
  Starts starts(objects_.size());
  std::vector<int> wanted;
  for (size_t i = 0; i < objects_.size(); ++i) {
    const Object& object = objects_[i];
    if (!started_ && object.parts.initial_T_camera_object) {
      starts[i] = ObjectPrediction{*object.parts.initial_T_camera_object};
      continue;
    }
    if (isWanted(object)) wanted.push_back(static_cast<int>(i));
    if ((starts[i] = predict(object)))
      result.events.push_back(
          {now_ns_, object.parts.name, "reset", 0, "restarted from the graph's prediction"});
  }
  if (!wanted.empty()) detect(frame, wanted, starts, result);
  return starts;
}

void Pipeline::detect(const Frame& frame, const std::vector<int>& wanted, Starts& starts,
                      FrameResult& result) {
  const auto detections = detector_->detect(frame, wanted);
  for (size_t k = 0; k < wanted.size(); ++k) {
    if (!detections[k]) continue;
    const size_t i = static_cast<size_t>(wanted[k]);
    starts[i] = ObjectPrediction{detections[k]->T_camera_object};
    starts[i]->verified = true;
    const int inliers = detections[k]->inliers;
    result.events.push_back(
        {now_ns_, objects_[i].parts.name, "detected", detections[k]->health,
         inliers > 0 ? std::to_string(inliers) + " features agree" : "found by its edges"});
  }
}

void Pipeline::measureObjects(const Frame& frame, FrameResult& result) {
  const Stopwatch watch;
  const Starts starts = findStarts(frame, result);
  const bool track = method_ != Method::kVo || odometry_->wantsObjects();
  for (size_t i = 0; i < objects_.size(); ++i) {
    Object& object = objects_[i];
    if (starts[i]) {
      object.begun = true;
      if (method_ == Method::kVo && odometry_->started())
        object.T_world_object = T_world_camera_ * starts[i]->T_camera_object;
    }
    ++object.unclaimed_frames;
    if (!track) {
      object.claimed = false;
      continue;
    }
    ObjectMeasurement measurement = object.parts.tracker->track(frame, starts[i]);
    noteChange(object, measurement, result);
    object.claimed = measurement.claimed;
    if (object.claimed) object.unclaimed_frames = 0;
    result.objects.push_back({std::move(measurement), std::nullopt});
  }
  result.tracker_ms = watch.ms();
}

void Pipeline::noteChange(Object& object, const ObjectMeasurement& measurement,
                          FrameResult& result) const {
  const auto note = [&](const char* event) {
    result.events.push_back(
        {now_ns_, object.parts.name, event, measurement.health, measurement.reason});
  };
  if (!started_) note("started");
  if (measurement.claimed && !object.claimed) note(object.was_lost ? "reinitialised" : "tracked");
  if (!measurement.claimed && (object.claimed || (!started_ && object.begun))) note("lost");
  object.was_lost = object.was_lost || (object.begun && !measurement.claimed);
}

void Pipeline::updateMap(FrameResult& result) {
  const Stopwatch watch;
  for (const ObjectResult& object : result.objects) {
    if (!object.measurement->claimed) continue;
    const AddResult added = mapper_.addObject(*object.measurement);
    if (!added)
      result.events.push_back({now_ns_, object.measurement->object, "rejected", 0, added.reason});
  }
  result.T_world_camera = mapper_.update().T_world_camera;
  result.mapper_ms = watch.ms();
}

void Pipeline::reportObjects(FrameResult& result) const {
  result.objects.resize(objects_.size());
  const MapEstimate map = method_ == Method::kFused ? mapper_.estimate() : MapEstimate{};
  for (size_t i = 0; i < objects_.size(); ++i) {
    ObjectResult& object = result.objects[i];
    const PipelineObject& parts = objects_[i].parts;
    if (method_ == Method::kEbt && object.measurement->claimed)
      object.T_camera_object = object.measurement->T_camera_object;
    if (method_ == Method::kVo) object.T_camera_object = carriedByOdometry(objects_[i]);
    if (method_ != Method::kFused) continue;
    for (const ObjectEstimate& estimate : map.objects)
      if (estimate.name == parts.name)
        object.T_camera_object = map.T_world_camera.inverse() * estimate.T_world_object;
  }
}

Pipeline::Final Pipeline::finish() {
  if (method_ != Method::kFused || !started_) {
    Final final{camera_, {now_ns_, T_world_camera_, {}}};
    if (method_ == Method::kVo)
      for (const Object& object : objects_)
        if (const auto T_camera_object = carriedByOdometry(object))
          final.map.objects.push_back({object.parts.name, T_world_camera_ * *T_camera_object});
    return final;
  }
  MapEstimate map = mapper_.finish();
  return {mapper_.smoothedTrajectory(), std::move(map)};
}

}  // namespace diorama
