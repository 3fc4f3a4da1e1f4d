// Reads the frames of a source ahead of their use, several at a time, and hands them out in order.
#pragma once

#include <deque>
#include <future>
#include <vector>

#include "core/frame_source.h"

namespace diorama {

class Prefetcher {
 public:
  // Reads `indices` in this order with `workers` threads. The source must outlive the prefetcher.
  Prefetcher(FrameSource& source, std::vector<int> indices, int workers);

  bool done() const { return next_ == indices_.size() && pending_.empty(); }
  // Rethrows what reading the frame threw.
  FrameAndTruth next();
  // Mean time of one read() call, ms.
  double readMs() const { return count_ == 0 ? 0 : total_ms_ / static_cast<double>(count_); }

 private:
  struct Timed {
    FrameAndTruth frame;
    double ms = 0;
  };
  void fill();

  FrameSource& source_;
  std::vector<int> indices_;
  size_t workers_;
  size_t next_ = 0;
  std::deque<std::future<Timed>> pending_;
  double total_ms_ = 0;
  size_t count_ = 0;
};

}  // namespace diorama
