// The real-time scheduler: the stages of app/pipeline.h, each in a thread of its own. Frames come
// when they come; a stage that is behind loses the oldest of those that wait for it, and says so.
//
//   push() ─> odometry ──────────────────┐
//        └──> each object's tracker ─────┴─> map ─> wait()
//                 │ ^         ^               │
//                 v │         └── guidance ───┘
//               detector
//
// The map's mailbox is bounded, too: when it is full, whoever has something to say waits, and drops
// frames himself. The map waits for nobody, and trackers only for the detector, so that nothing can
// lock up.
//
// In the beginning everything waits until the objects have been looked for in the first frame; the
// frames that come meanwhile are caught up with. Later on trackers go on without the detector.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "app/map_stage.h"
#include "app/pipeline_types.h"

namespace diorama {

class RealtimePipeline {
 public:
  using FramePointer = std::shared_ptr<const Frame>;
  using Clock = std::chrono::steady_clock;

  // As of Pipeline; latencies are those that there are.
  explicit RealtimePipeline(PipelineParts&& parts);
  ~RealtimePipeline();
  RealtimePipeline(const RealtimePipeline&) = delete;
  RealtimePipeline& operator=(const RealtimePipeline&) = delete;

  // From one thread: frames, in the order of their time stamps; waits for no stage.
  void push(FramePointer frame);
  void close();  // no frame comes any more
  // Sleeps until then; false when the run was stopped.
  bool sleepUntil(Clock::time_point time);

  // Ends all threads as soon as they can be; what was not finished is lost.
  void stop();
  void fail(std::exception_ptr failure);  // and wait() throws this

  // From one thread: results in the order of the frames, one for each. Returns with none after a
  // while, or when it has ended. Throws what a stage has thrown.
  std::vector<FrameResult> wait(std::chrono::milliseconds longest);
  bool ended();  // throws, too

  // Once ended.
  FinalEstimate finish() { return map_.finish(); }

 private:
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::min();

  struct Queue {
    std::deque<FramePointer> waiting;
    std::vector<int64_t> dropped;  // since the last one that was taken
    bool begun = false;
    bool starting = true;  // has not yet caught up with the frames of the beginning
  };
  struct Answer {
    std::optional<Detection> detection;  // in the first of the frames that were kept
  };
  // One object's tracker, and what it exchanges with the others.
  struct Tracker {
    ObjectStage stage;
    Queue queue = {};
    Guidance guidance = {};
    std::deque<ObjectMeasurement> measurements = {};  // of its newest frames
    int64_t passed_ns = kNever;                       // its newest frame, or one that it dropped
    FramePointer request = {};                        // to look for the object in
    std::optional<Answer> answer = {};
    std::vector<FramePointer> kept = {};  // since the one that was asked for; the thread's own
  };

  template <class Work>
  void begin(Work work);
  void runOdometry();
  void runTracker(size_t object);
  void runDetector();
  void runMap();

  FramePointer next(Queue& queue, std::optional<size_t> object);
  void send(std::unique_lock<std::mutex>& lock, Message message);
  SeenObjects seenIn(const Frame& frame);
  Sighting measure(Tracker& tracker, const FramePointer& frame);
  FramePointer nextSearch();
  static Sighting catchUp(ObjectStage& stage, std::span<const FramePointer> frames,
                          const Detection& detection, Guidance guidance);
  void publish();

  const size_t capacity_;
  MapStage map_;
  std::optional<CameraStage> camera_;
  std::deque<Tracker> trackers_;
  std::unique_ptr<ObjectDetector> detector_;

  std::mutex mutex_;  // of everything below, and of what is exchanged of trackers_
  std::condition_variable changed_;
  Queue camera_queue_;
  std::deque<Message> mailbox_;
  std::vector<FrameResult> results_;
  CameraMotion motion_;  // to carry guidance on
  int64_t newest_ns_ = 0;
  size_t senders_ = 0, trackers_left_ = 0;
  bool closed_ = false, stopped_ = false, ended_ = false;
  std::exception_ptr failure_;
  std::vector<std::thread> threads_;
};

}  // namespace diorama
