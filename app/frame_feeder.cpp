#include "app/frame_feeder.h"

#include "app/prefetcher.h"
#include "app/workers.h"
#include "core/errors.h"

namespace diorama {

FrameFeeder::FrameFeeder(FrameSource& source, std::vector<int> indices, RealtimePipeline& pipeline)
    : source_(source), indices_(std::move(indices)), pipeline_(pipeline), thread_([this] {
        try {
          run();
        } catch (...) {
          pipeline_.fail(std::current_exception());
        }
      }) {}

FrameFeeder::~FrameFeeder() {
  pipeline_.stop();
  thread_.join();
}

FrameFeeder::Fed FrameFeeder::take() {
  const std::lock_guard lock(mutex_);
  DIORAMA_CHECK(!fed_.empty());
  Fed oldest = std::move(fed_.front());
  fed_.pop_front();
  return oldest;
}

void FrameFeeder::run() {
  using Clock = RealtimePipeline::Clock;
  Prefetcher prefetcher(source_, indices_, workerCount());
  std::optional<Clock::time_point> start;  // when a frame of time 0 would have come
  for (size_t i = 0; i < indices_.size(); ++i) {
    FrameAndTruth read = prefetcher.next();
    read.frame.index = static_cast<int>(i);
    const auto frame = std::make_shared<const Frame>(std::move(read.frame));
    const auto time = std::chrono::nanoseconds(frame->timestamp_ns);
    if (!start) start = Clock::now() - time;
    const Clock::duration late = Clock::now() - (*start + time);
    if (late > Clock::duration::zero()) {
      *start += late;
      late_s_ += std::chrono::duration<double>(late).count();
    }
    if (!pipeline_.sleepUntil(*start + time)) return;
    {
      const std::lock_guard lock(mutex_);
      fed_.push_back({frame, std::move(read.truth)});
    }
    pipeline_.push(frame);
  }
  read_ms_ = prefetcher.readMs();
  pipeline_.close();
}

}  // namespace diorama
