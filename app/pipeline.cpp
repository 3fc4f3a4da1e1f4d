#include "app/pipeline.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

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
    mapper_.setSymmetries(object.name, object.symmetries);
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
  noteAbsences(result);
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

// What an odometry that measured nothing takes for the motion since the frame before.
SE3 Pipeline::guessedStep(const FrameResult& result) const {
  const bool from_last = result.odometry && !camera_.poses.empty() &&
                         result.odometry->from_ns == camera_.poses.back().timestamp_ns;
  return from_last ? result.odometry->T_from_to : SE3{};
}

void Pipeline::moveMap(FrameResult& result) {
  if (!mapper_.started()) return;
  AddResult added{false, "the odometry gave nothing"};
  if (result.odometry) added = mapper_.addOdometry(*result.odometry);
  if (!added) DIORAMA_CHECK(mapper_.addGap(now_ns_, guessedStep(result)));
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

// In fused, the graph's idea of an object that the tracker does not hold, or holds elsewhere.
std::optional<ObjectPrediction> Pipeline::predict(const Object& object) const {
  if (method_ != Method::kFused || !object.begun) return std::nullopt;
  if (object.claimed && object.rejected < options_.reset_after_rejected) return std::nullopt;
  return mapper_.predict(object.parts.name);
}

// In vo: where the odometry has placed the object itself, or else where its start put it.
std::optional<SE3> Pipeline::carriedByOdometry(const Object& object) const {
  if (const auto located = odometry_->locate(object.parts.name)) return located;
  if (!object.T_world_object) return std::nullopt;
  return T_world_camera_.inverse() * *object.T_world_object;
}

// Whether an object without a prediction, or with a vague one, or one that has led to nothing for
// long, is to be looked for in this frame.
bool Pipeline::isWanted(const Object& object) const {
  if (!detector_ || (object.claimed && !object.overdue)) return false;
  if (method_ == Method::kVo && !odometry_->wantsObjects() && carriedByOdometry(object))
    return false;  // placed once
  if (object.missed_frames % options_.search_every_frames != 0) return false;
  const auto prediction = predict(object);
  return object.overdue || !prediction || isVague(*prediction);
}

bool Pipeline::isVague(const ObjectPrediction& prediction) const {
  const auto worst = [&](int first) {
    const Matrix3d block = prediction.covariance.block<3, 3>(first, first);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(block, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
  };
  return worst(0) > options_.redetect_above_m || worst(3) > options_.redetect_above_rad;
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
          {now_ns_, object.parts.name, "reset", static_cast<double>(object.missed_frames),
           object.claimed ? "rejected by the graph; restarted from its prediction"
                          : "restarted from the graph's prediction"});
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
    if (objects_[i].overdue) mapper_.doubt(objects_[i].parts.name);
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
    if (!track) {
      object.claimed = false;
      continue;
    }
    ObjectMeasurement measurement = object.parts.tracker->track(frame, starts[i]);
    noteChange(object, measurement, result);
    object.claimed = measurement.claimed;
    // The graph has the last word in fused.
    if (object.claimed && method_ != Method::kFused) noteHeard(object);
    result.objects.push_back({std::move(measurement), std::nullopt});
  }
  result.tracker_ms = watch.ms();
}

void Pipeline::noteHeard(Object& object) const {
  object.rejected = object.missed_frames = 0;
  object.heard_ns = now_ns_;
  object.overdue = false;
}

// Counts the frames without a word of an object (the counter of Algorithm 1).
void Pipeline::noteAbsences(FrameResult& result) {
  for (Object& object : objects_) {
    if (!object.heard_ns) object.heard_ns = now_ns_;
    if (*object.heard_ns == now_ns_ && object.claimed) continue;
    ++object.missed_frames;
    const bool overdue =
        object.missed_frames >= options_.redetect_after_frames ||
        1e-9 * static_cast<double>(now_ns_ - *object.heard_ns) >= options_.redetect_after_s;
    if (overdue && !object.overdue && method_ == Method::kFused && object.begun)
      result.events.push_back({now_ns_, object.parts.name, "lost",
                               static_cast<double>(object.missed_frames),
                               "the graph has not heard of it for too long: looked for anew"});
    object.overdue = overdue;
  }
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

// The map's world is the camera frame in which the odometry starts. Before, the objects alone would
// tell where the camera is, and what is learnt of that later would go on moving the world.
bool Pipeline::startMap() {
  if (mapper_.started()) return true;
  if (!first_ns_) first_ns_ = now_ns_;
  const double waited_s = 1e-9 * static_cast<double>(now_ns_ - *first_ns_);
  if (!odometry_->started() && waited_s < options_.odometry_wait_s) return false;
  mapper_.start(now_ns_);
  return true;
}

void Pipeline::updateMap(FrameResult& result) {
  const Stopwatch watch;
  if (!startMap()) {
    for (Object& object : objects_)
      if (object.claimed) noteHeard(object);
    return;
  }
  for (size_t i = 0; i < objects_.size(); ++i) {
    const ObjectMeasurement& measurement = *result.objects[i].measurement;
    if (!measurement.claimed) {
      objects_[i].rejected = 0;
      continue;
    }
    const AddResult added = mapper_.addObject(measurement);
    if (added) {
      noteHeard(objects_[i]);
      continue;
    }
    ++objects_[i].rejected;
    result.events.push_back(
        {now_ns_, measurement.object, "rejected", added.innovation.value_or(0), added.reason});
  }
  result.T_world_camera = mapper_.update().T_world_camera;
  result.mapper_ms = watch.ms();
}

void Pipeline::reportObjects(FrameResult& result) const {
  result.objects.resize(objects_.size());
  const bool fused = method_ == Method::kFused && mapper_.started();
  const MapEstimate map = fused ? mapper_.estimate() : MapEstimate{};
  for (size_t i = 0; i < objects_.size(); ++i) {
    ObjectResult& object = result.objects[i];
    const PipelineObject& parts = objects_[i].parts;
    if (method_ != Method::kVo && !fused && object.measurement->claimed)
      object.T_camera_object = object.measurement->T_camera_object;
    if (method_ == Method::kVo) object.T_camera_object = carriedByOdometry(objects_[i]);
    if (!fused) continue;
    for (const ObjectEstimate& estimate : map.objects)
      if (estimate.name == parts.name)
        object.T_camera_object = map.T_world_camera.inverse() * estimate.T_world_object;
  }
}

Pipeline::Final Pipeline::finish() {
  if (method_ != Method::kFused || !mapper_.started()) {
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
