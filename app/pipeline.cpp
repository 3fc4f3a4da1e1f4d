#include "app/pipeline.h"

#include "app/stopwatch.h"

namespace diorama {

Pipeline::Pipeline(Method method, std::vector<PipelineObject> objects,
                   std::unique_ptr<Odometry> odometry, const MapperOptions& mapper_options)
    : method_(method), odometry_(std::move(odometry)), mapper_(mapper_options) {
  for (PipelineObject& object : objects) objects_.push_back({std::move(object)});
}

FrameResult Pipeline::process(const Frame& frame) {
  FrameResult result;
  now_ns_ = frame.timestamp_ns;
  if (method_ != Method::kEbt) moveCamera(frame, result);
  if (method_ != Method::kVo) measureObjects(frame, result);
  if (method_ == Method::kFused) updateMap(result);
  reportObjects(result);
  started_ = true;
  return result;
}

void Pipeline::moveCamera(const Frame& frame, FrameResult& result) {
  const Stopwatch watch;
  result.odometry = odometry_->track(frame);
  result.odometry_ms = watch.ms();
  if (result.odometry) T_world_camera_ = T_world_camera_ * result.odometry->T_from_to;
  result.T_world_camera = T_world_camera_;
  camera_.poses.push_back({now_ns_, T_world_camera_});
  if (method_ != Method::kFused) return;

  if (!started_) {
    mapper_.start(now_ns_);
    return;
  }
  AddResult added{false, "the odometry gave nothing"};
  if (result.odometry) added = mapper_.addOdometry(*result.odometry);
  if (added) return;
  result.events.push_back({now_ns_, "odometry", "lost", 0, added.reason});
  DIORAMA_CHECK(mapper_.addGap(now_ns_));
}

// The initial pose in the first frame; in fused, the graph's prediction after a frame in which the
// tracker did not hold the object; otherwise the tracker goes on by itself.
std::optional<ObjectPrediction> Pipeline::startOf(const Object& object, FrameResult& result) const {
  if (!started_) return ObjectPrediction{object.parts.initial_T_camera_object};
  if (method_ != Method::kFused || object.claimed) return std::nullopt;
  std::optional<ObjectPrediction> prediction = mapper_.predict(object.parts.name);
  if (prediction)
    result.events.push_back(
        {now_ns_, object.parts.name, "reset", 0, "restarted from the graph's prediction"});
  return prediction;
}

void Pipeline::measureObjects(const Frame& frame, FrameResult& result) {
  const Stopwatch watch;
  for (Object& object : objects_) {
    ObjectMeasurement measurement = object.parts.tracker->track(frame, startOf(object, result));
    noteChange(object, measurement, result);
    object.claimed = measurement.claimed;
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
  if (!measurement.claimed && (object.claimed || !started_)) note("lost");
  object.was_lost = object.was_lost || !measurement.claimed;
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
    if (method_ == Method::kVo)  // placed once, in the first frame, and carried by odometry
      object.T_camera_object = T_world_camera_.inverse() * parts.initial_T_camera_object;
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
        final.map.objects.push_back({object.parts.name, object.parts.initial_T_camera_object});
    return final;
  }
  MapEstimate map = mapper_.finish();
  return {mapper_.smoothedTrajectory(), std::move(map)};
}

}  // namespace diorama
