#include "app/prefetcher.h"

#include <algorithm>

#include "app/stopwatch.h"

namespace diorama {

Prefetcher::Prefetcher(FrameSource& source, std::vector<int> indices, int workers)
    : source_(source),
      indices_(std::move(indices)),
      workers_(static_cast<size_t>(std::max(1, workers))) {
  fill();
}

void Prefetcher::fill() {
  while (pending_.size() < workers_ && next_ < indices_.size()) {
    const int index = indices_[next_++];
    pending_.push_back(std::async(std::launch::async, [this, index] {
      const Stopwatch watch;
      FrameAndTruth frame = source_.read(index);
      return Timed{std::move(frame), watch.ms()};
    }));
  }
}

FrameAndTruth Prefetcher::next() {
  std::future<Timed> oldest = std::move(pending_.front());
  pending_.pop_front();
  Timed timed = oldest.get();
  total_ms_ += timed.ms;
  ++count_;
  fill();
  return std::move(timed.frame);
}

}  // namespace diorama
