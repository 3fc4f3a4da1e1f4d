#include "app/pipeline.h"

#include <cmath>
#include <future>
#include <limits>

#include "app/stopwatch.h"

namespace diorama {
Pipeline::Pipeline(PipelineParts&& parts)
    : map_(parts.method, parts.objects, parts.mapper, parts.options),
      detector_(std::move(parts.detector)),
      latency_s_(parts.options.latency_s) {
  if (parts.method != Method::kEbt) camera_.emplace(std::move(parts.odometry), map_.names());
  for (size_t i = 0; i < parts.objects.size(); ++i)
    objects_.emplace_back(std::move(parts.objects[i]), i, parts.method, detector_ != nullptr,
                          parts.options);
}

std::vector<FrameResult> Pipeline::process(const Frame& frame) {
  now_ns_ = frame.timestamp_ns;
  arrive(now_ns_);

  std::vector<std::future<Sighting>> held = beginHeld(frame);
  if (camera_) send(camera_->track(frame), latency_s_.odometry);
  arrive(now_ns_);

  std::vector<std::optional<ObjectMeasurement>> measured(objects_.size());
  const auto take = [&](Sighting sighting) {
    measured[sighting.object] = sighting.measurement;
    send(std::move(sighting), latency_s_.tracker);
  };
  std::vector<size_t> others;
  for (size_t i = 0; i < objects_.size(); ++i)
    if (held[i].valid())
      take(held[i].get());
    else
      others.push_back(i);
  // One object that is held tells where the others are.
  arrive(now_ns_);
  map_.update();
  for (Sighting& sighting : measure(others, frame)) take(std::move(sighting));

  SeenObjects seen;
  for (size_t i = 0; i < measured.size(); ++i)
    if (measured[i])
      (map_.standing(i).moving ? seen.moving : seen.at_rest).push_back(std::move(*measured[i]));
  if (camera_) send(camera_->update(seen), latency_s_.odometry);
  arrive(now_ns_);
  map_.update();
  return map_.finished();
}

std::vector<FrameResult> Pipeline::drain() {
  arrive(std::numeric_limits<int64_t>::max());
  return map_.finished();
}

void Pipeline::send(Message message, double latency_s) {
  under_way_.emplace(now_ns_ + std::llround(1e9 * latency_s), std::move(message));
}

void Pipeline::arrive(int64_t now_ns) {
  const auto later = under_way_.upper_bound(now_ns);
  for (auto message = under_way_.begin(); message != later; ++message)
    map_.take(std::move(message->second));
  under_way_.erase(under_way_.begin(), later);
}

// Beside the odometry: trackers that hold their objects ask nobody. One future per object, without
// a state for the others. A single tracker has nothing to work beside.
std::vector<std::future<Sighting>> Pipeline::beginHeld(const Frame& frame) {
  const auto how = camera_ || objects_.size() > 1 ? std::launch::async : std::launch::deferred;
  std::vector<std::future<Sighting>> sightings(objects_.size());
  for (size_t i = 0; i < objects_.size(); ++i) {
    const Guidance standing = map_.standing(i);
    if (!objects_[i].isHeld(standing)) continue;
    sightings[i] = std::async(how, [this, i, &frame, standing] {
      return objects_[i].track(frame, standing, std::nullopt);
    });
  }
  return sightings;
}

// Those that ask the map, which knows now how the camera moved.
std::vector<Sighting> Pipeline::measure(const std::vector<size_t>& objects, const Frame& frame) {
  std::vector<Guidance> guidance(objects_.size());
  std::vector<int> wanted;
  for (const size_t i : objects) {
    guidance[i] = map_.guide(i, frame.timestamp_ns);
    if (objects_[i].isWanted(guidance[i])) wanted.push_back(static_cast<int>(i));
  }
  const Stopwatch watch;
  std::vector<std::optional<Detection>> detections(objects_.size());
  if (!wanted.empty()) {
    const auto found = detector_->detect(frame, wanted);
    for (size_t k = 0; k < wanted.size(); ++k)
      detections[static_cast<size_t>(wanted[k])] = found[k];
  }
  const double detection_ms = wanted.empty() ? 0 : watch.ms();
  std::vector<Sighting> sightings;
  for (const size_t i : objects)
    sightings.push_back(objects_[i].track(frame, guidance[i], detections[i]));
  if (!sightings.empty()) sightings.front().ms += detection_ms;
  return sightings;
}

}  // namespace diorama
