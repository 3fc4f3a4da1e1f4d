// Lets the frames of a source come at the pace of their time stamps.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "app/realtime_pipeline.h"
#include "core/frame_source.h"

namespace diorama {

class FrameFeeder {
 public:
  // Begins at once, in a thread of its own. The source and the pipeline must outlive the feeder.
  FrameFeeder(FrameSource& source, std::vector<int> indices, RealtimePipeline& pipeline);
  ~FrameFeeder();  // stops the pipeline
  FrameFeeder(const FrameFeeder&) = delete;
  FrameFeeder& operator=(const FrameFeeder&) = delete;

  struct Fed {
    std::shared_ptr<const Frame> frame;
    std::optional<GroundTruth> truth;
  };
  // The oldest frame that was fed and not taken yet; one must be there.
  Fed take();

  // Once the pipeline has ended: how much later the last frame came than its time stamp says, since
  // reading (or drawing) the frames took longer than the time between them. The others wait for the
  // one that is late, they do not catch up: a camera is never faster than its rate.
  double late_s() const { return late_s_; }
  double readMs() const { return read_ms_; }

 private:
  void run();

  FrameSource& source_;
  std::vector<int> indices_;
  RealtimePipeline& pipeline_;
  std::mutex mutex_;
  std::deque<Fed> fed_;
  double late_s_ = 0, read_ms_ = 0;
  std::thread thread_;
};

}  // namespace diorama
