#include "app/realtime_pipeline.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace diorama {
namespace {

// Frames that are kept at most while the detector works.
constexpr size_t kMostKept = 60;

// Every other one goes, but for the first and the last.
template <class T>
void thinOut(std::vector<T>& list) {
  size_t kept = 1;
  for (size_t k = 2; k + 1 < list.size(); k += 2) list[kept++] = std::move(list[k]);
  list[kept++] = std::move(list.back());
  list.resize(kept);
}

}  // namespace

RealtimePipeline::RealtimePipeline(PipelineParts&& parts)
    : capacity_(static_cast<size_t>(parts.options.queue_frames)),
      map_(parts.method, parts.objects, parts.mapper, parts.options),
      detector_(std::move(parts.detector)) {
  if (parts.method != Method::kEbt) camera_.emplace(std::move(parts.odometry), map_.names());
  for (size_t i = 0; i < parts.objects.size(); ++i) {
    ObjectStage stage(std::move(parts.objects[i]), i, parts.method, detector_ != nullptr,
                      parts.options);
    trackers_.push_back({std::move(stage)});
  }
  publish();
  trackers_left_ = trackers_.size();
  senders_ = trackers_.size() + (camera_ ? 1 : 0);
  begin([this] { runMap(); });
  if (camera_) begin([this] { runOdometry(); });
  for (size_t i = 0; i < trackers_.size(); ++i) begin([this, i] { runTracker(i); });
  if (detector_) begin([this] { runDetector(); });
}

RealtimePipeline::~RealtimePipeline() {
  stop();
  for (std::thread& thread : threads_) thread.join();
}

// What a stage throws ends the run.
template <class Work>
void RealtimePipeline::begin(Work work) {
  threads_.emplace_back([this, work] {
    try {
      work();
    } catch (...) {
      fail(std::current_exception());
    }
  });
}

void RealtimePipeline::push(FramePointer frame) {
  const std::lock_guard lock(mutex_);
  const auto add = [&](Queue& queue) {
    if (queue.waiting.size() >= (queue.starting ? kMostKept : capacity_)) {
      queue.dropped.push_back(queue.waiting.front()->timestamp_ns);
      queue.waiting.pop_front();
    }
    queue.waiting.push_back(frame);
  };
  if (camera_) add(camera_queue_);
  for (Tracker& tracker : trackers_) add(tracker.queue);
  changed_.notify_all();
}

void RealtimePipeline::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

bool RealtimePipeline::sleepUntil(Clock::time_point time) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_until(lock, time, [&] { return stopped_; });
}

void RealtimePipeline::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

void RealtimePipeline::fail(std::exception_ptr failure) {
  const std::lock_guard lock(mutex_);
  if (!failure_) failure_ = failure;
  stopped_ = true;
  changed_.notify_all();
}

std::vector<FrameResult> RealtimePipeline::wait(std::chrono::milliseconds longest) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, longest, [&] { return failure_ || ended_ || !results_.empty(); });
  if (failure_) std::rethrow_exception(failure_);
  return std::exchange(results_, {});
}

bool RealtimePipeline::ended() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  return ended_ && results_.empty();
}

// The oldest frame that waits, or none at the end. Tells the map of those that were dropped before.
RealtimePipeline::FramePointer RealtimePipeline::next(Queue& queue, std::optional<size_t> object) {
  std::unique_lock lock(mutex_);
  if (queue.begun && queue.waiting.empty()) queue.starting = false;
  changed_.wait(lock, [&] { return stopped_ || closed_ || !queue.waiting.empty(); });
  queue.begun = true;
  FramePointer frame;
  if (!stopped_ && !queue.waiting.empty()) {
    frame = std::move(queue.waiting.front());
    queue.waiting.pop_front();
  }
  for (const int64_t timestamp_ns : std::exchange(queue.dropped, {}))
    send(lock, Drop{object, timestamp_ns});
  return frame;
}

void RealtimePipeline::send(std::unique_lock<std::mutex>& lock, Message message) {
  changed_.wait(lock, [&] { return stopped_ || mailbox_.size() < capacity_ * (1 + senders_); });
  mailbox_.push_back(std::move(message));
  changed_.notify_all();
}

void RealtimePipeline::runOdometry() {
  while (const FramePointer frame = next(camera_queue_, std::nullopt)) {
    CameraStep step = camera_->track(*frame);
    {
      std::unique_lock lock(mutex_);
      send(lock, std::move(step));
    }
    CameraUpdate update = camera_->update(seenIn(*frame));
    std::unique_lock lock(mutex_);
    send(lock, std::move(update));
  }
  const std::lock_guard lock(mutex_);
  --senders_;
  changed_.notify_all();
}

// The odometry waits for what the trackers see in its frame, until the next frame waits for it.
SeenObjects RealtimePipeline::seenIn(const Frame& frame) {
  const auto passed = [&](const Tracker& t) { return t.passed_ns >= frame.timestamp_ns; };
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] {
    return stopped_ || (!camera_queue_.starting && !camera_queue_.waiting.empty()) ||
           std::all_of(trackers_.begin(), trackers_.end(), passed);
  });
  SeenObjects seen;
  for (const Tracker& tracker : trackers_)
    for (const ObjectMeasurement& m : tracker.measurements)
      if (m.timestamp_ns == frame.timestamp_ns)
        (tracker.guidance.moving ? seen.moving : seen.at_rest).push_back(m);
  return seen;
}

void RealtimePipeline::runTracker(size_t object) {
  Tracker& tracker = trackers_[object];
  while (const FramePointer frame = next(tracker.queue, object)) {
    Sighting sighting = measure(tracker, frame);
    std::unique_lock lock(mutex_);
    if (sighting.measurement) tracker.measurements.push_back(*sighting.measurement);
    if (tracker.measurements.size() > kMostKept) tracker.measurements.pop_front();
    tracker.passed_ns = frame->timestamp_ns;
    send(lock, std::move(sighting));
  }
  const std::lock_guard lock(mutex_);
  tracker.passed_ns = std::numeric_limits<int64_t>::max();
  --senders_;
  --trackers_left_;
  changed_.notify_all();
}

// While the detector looks for the object in one frame, the tracker goes on, and keeps the frames;
// in the first frame it waits.
Sighting RealtimePipeline::measure(Tracker& tracker, const FramePointer& frame) {
  std::unique_lock lock(mutex_);
  Guidance guidance = tracker.guidance;
  if (guidance.prediction)
    guidance.prediction = motion_.carry(*guidance.prediction, newest_ns_, frame->timestamp_ns);
  const bool first = tracker.passed_ns == kNever;
  const bool ask = tracker.kept.empty() && tracker.stage.isWanted(guidance);
  if (ask) {
    tracker.request = frame;
    changed_.notify_all();
  }
  if (ask || !tracker.kept.empty()) tracker.kept.push_back(frame);
  if (ask && first) changed_.wait(lock, [&] { return stopped_ || tracker.answer; });
  const std::optional<Answer> answer = std::exchange(tracker.answer, std::nullopt);
  lock.unlock();

  if (tracker.kept.size() > kMostKept) thinOut(tracker.kept);
  if (!answer) return tracker.stage.track(*frame, guidance, std::nullopt);
  const std::vector<FramePointer> kept = std::exchange(tracker.kept, {});
  if (!answer->detection || !tracker.stage.isMissing(guidance))
    return tracker.stage.track(*frame, guidance, std::nullopt);
  return catchUp(tracker.stage, kept, *answer->detection, guidance);
}

// From the first of the frames, in which the object was found, to the last.
Sighting RealtimePipeline::catchUp(ObjectStage& stage, std::span<const FramePointer> frames,
                                   const Detection& detection, Guidance guidance) {
  Sighting all = stage.track(*frames.front(), guidance, detection);
  guidance.prediction.reset();
  for (const FramePointer& frame : frames.subspan(1)) {
    Sighting sighting = stage.track(*frame, guidance, std::nullopt);
    all.timestamp_ns = sighting.timestamp_ns;
    all.measurement = std::move(sighting.measurement);
    std::move(sighting.events.begin(), sighting.events.end(), std::back_inserter(all.events));
    all.ms += sighting.ms;
  }
  return all;
}

void RealtimePipeline::runDetector() {
  while (const FramePointer frame = nextSearch()) {
    std::vector<int> wanted;
    {
      const std::lock_guard lock(mutex_);
      for (size_t i = 0; i < trackers_.size(); ++i)
        if (trackers_[i].request == frame) wanted.push_back(static_cast<int>(i));
    }
    const auto found = detector_->detect(*frame, wanted);
    const std::lock_guard lock(mutex_);
    for (size_t k = 0; k < wanted.size(); ++k) {
      Tracker& tracker = trackers_[static_cast<size_t>(wanted[k])];
      tracker.request = nullptr;
      tracker.answer = Answer{found[k]};
    }
    changed_.notify_all();
  }
}

// The oldest frame to look for objects in, once all trackers have come so far: for several objects
// at once much of the work is the same. None at the end.
RealtimePipeline::FramePointer RealtimePipeline::nextSearch() {
  FramePointer oldest;
  const auto find = [&] {
    oldest = nullptr;
    for (const Tracker& tracker : trackers_)
      if (tracker.request && (!oldest || tracker.request->timestamp_ns < oldest->timestamp_ns))
        oldest = tracker.request;
    return oldest && std::all_of(trackers_.begin(), trackers_.end(), [&](const Tracker& tracker) {
             return tracker.request || tracker.passed_ns >= oldest->timestamp_ns;
           });
  };
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return stopped_ || trackers_left_ == 0 || find(); });
  return stopped_ || trackers_left_ == 0 ? nullptr : oldest;
}

void RealtimePipeline::runMap() {
  while (true) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return stopped_ || !mailbox_.empty() || senders_ == 0; });
    if (stopped_ || mailbox_.empty()) break;
    std::deque<Message> messages = std::exchange(mailbox_, {});
    changed_.notify_all();
    lock.unlock();
    for (Message& message : messages) map_.take(std::move(message));
    map_.update();
    publish();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

// What the trackers may know, and what is finished.
void RealtimePipeline::publish() {
  std::vector<Guidance> guidance;
  for (size_t i = 0; i < trackers_.size(); ++i) guidance.push_back(map_.guide(i, map_.newest_ns()));
  std::vector<FrameResult> finished = map_.finished();
  const std::lock_guard lock(mutex_);
  for (size_t i = 0; i < trackers_.size(); ++i) trackers_[i].guidance = std::move(guidance[i]);
  motion_ = map_.motion();
  newest_ns_ = map_.newest_ns();
  std::move(finished.begin(), finished.end(), std::back_inserter(results_));
  changed_.notify_all();
}

}  // namespace diorama
