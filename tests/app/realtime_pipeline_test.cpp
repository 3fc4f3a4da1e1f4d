#include "app/realtime_pipeline.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>

#include "app/frame_feeder.h"
#include "tests/support/fakes.h"

namespace diorama {
namespace {

using test::FakeOdometry;
using test::FakeTracker;
using namespace std::chrono_literals;

constexpr int64_t kStep_ns = 5'000'000;

SE3 shifted(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

std::shared_ptr<const Frame> frameAt(int k) {
  return std::make_shared<const Frame>(Frame{k, k * kStep_ns, {}, Image<uint8_t>(4, 4)});
}

// What the tracker of the box does before it measures, with the number of the frame.
class HookedTracker : public FakeTracker {
 public:
  HookedTracker(std::vector<bool> claims, std::function<void(int)> hook)
      : FakeTracker(
            "box", [](int k) { return shifted(0.01 * k); }, std::move(claims)),
        hook_(std::move(hook)) {}

  ObjectMeasurement track(const Frame& frame,
                          const std::optional<ObjectPrediction>& start) override {
    hook_(frame.index);
    ObjectMeasurement m = FakeTracker::track(frame, start);
    starts_at.push_back({frame.index, start.has_value()});
    started_ = started_ || start;
    m.claimed = m.claimed && started_;
    return m;
  }
  std::vector<std::pair<int, bool>> starts_at;

 private:
  std::function<void(int)> hook_;
  bool started_ = false;  // before, nothing is claimed
};

PipelineParts partsOf(Method method, std::unique_ptr<ObjectTracker> tracker) {
  PipelineParts parts;
  parts.method = method;
  parts.objects.push_back({"box", std::move(tracker), shifted(0)});
  parts.odometry =
      std::make_unique<FakeOdometry>(SE3{Eigen::Quaterniond::Identity(), {-0.01, 0, 0}});
  return parts;
}

std::unique_ptr<HookedTracker> trackerWith(std::function<void(int)> hook) {
  return std::make_unique<HookedTracker>(std::vector<bool>(1000, true), std::move(hook));
}

std::vector<FrameResult> resultsOf(RealtimePipeline& pipeline) {
  std::vector<FrameResult> all;
  while (!pipeline.ended())
    for (FrameResult& result : pipeline.wait(1s)) all.push_back(std::move(result));
  return all;
}

int countEvents(const std::vector<FrameResult>& results, const std::string& source,
                const std::string& event) {
  int count = 0;
  for (const FrameResult& result : results)
    for (const Event& e : result.events) count += e.source == source && e.event == event;
  return count;
}

TEST(RealtimePipeline, ATrackerThatIsBehindLosesTheOldestFramesAndSaysSo) {
  std::latch entered(1), go(1);
  PipelineParts parts = partsOf(Method::kEbt, trackerWith([&](int k) {
                                  if (k != 0) return;
                                  entered.count_down();
                                  go.wait();
                                }));
  RealtimePipeline pipeline(std::move(parts));
  pipeline.push(frameAt(0));
  entered.wait();
  for (int k = 1; k < 100; ++k) pipeline.push(frameAt(k));
  pipeline.close();
  go.count_down();

  // Sixty may wait in the beginning.
  const std::vector<FrameResult> results = resultsOf(pipeline);
  ASSERT_EQ(results.size(), 100u);
  for (int k = 0; k < 100; ++k) {
    const FrameResult& result = results[static_cast<size_t>(k)];
    EXPECT_EQ(result.timestamp_ns, k * kStep_ns);
    EXPECT_EQ(result.dropped, k >= 1 && k <= 39) << k;
    EXPECT_EQ(result.objects[0].measurement.has_value(), !result.dropped) << k;
  }
  EXPECT_EQ(countEvents(results, "box", "dropped"), 39);
}

// Whatever is dropped where: one result for each frame, in order, and a map in the end.
TEST(RealtimePipeline, FramesThatComeTooFastNeverLockUp) {
  PipelineParts parts =
      partsOf(Method::kFused, trackerWith([](int k) { std::this_thread::sleep_for(k % 3 * 1ms); }));
  parts.options.queue_frames = 2;
  RealtimePipeline pipeline(std::move(parts));
  std::vector<FrameResult> results;
  for (int k = 0; k < 300; ++k) {
    pipeline.push(frameAt(k));
    if (k % 7 == 0) std::this_thread::sleep_for(1ms);
  }
  pipeline.close();
  results = resultsOf(pipeline);
  ASSERT_EQ(results.size(), 300u);
  int dropped = 0;
  for (int k = 0; k < 300; ++k) {
    EXPECT_EQ(results[static_cast<size_t>(k)].timestamp_ns, k * kStep_ns);
    dropped += results[static_cast<size_t>(k)].dropped;
  }
  EXPECT_GT(dropped, 0);
  EXPECT_GE(countEvents(results, "box", "dropped") + countEvents(results, "odometry", "dropped"),
            dropped);
  EXPECT_EQ(pipeline.finish().map.objects.size(), 1u);
}

TEST(RealtimePipeline, WithoutHasteTheResultIsThatOfLockStep) {
  RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int) {})));
  std::vector<FrameResult> results;
  for (int k = 0; k < 40; ++k) {
    pipeline.push(frameAt(k));
    while (results.size() <= static_cast<size_t>(k))
      for (FrameResult& result : pipeline.wait(1s)) results.push_back(std::move(result));
  }
  pipeline.close();
  EXPECT_TRUE(resultsOf(pipeline).empty());
  EXPECT_EQ(countEvents(results, "box", "dropped"), 0);
  EXPECT_NEAR(results[39].objects[0].T_camera_object->translation.x(), 0.39, 1e-4);
  EXPECT_EQ(pipeline.finish().camera.poses.size(), 40u);
}

TEST(RealtimePipeline, WhatAStageThrowsEndsTheRun) {
  RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int k) {
                                      if (k == 5) throw std::runtime_error("out of tune");
                                    })));
  for (int k = 0; k < 6; ++k) {
    pipeline.push(frameAt(k));
    std::this_thread::sleep_for(1ms);
  }
  try {
    resultsOf(pipeline);
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "out of tune");
  }
}

TEST(RealtimePipeline, CanBeLeftAtAnyTime) {
  for (int frames : {0, 1, 20}) {
    RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int) {})));
    for (int k = 0; k < frames; ++k) pipeline.push(frameAt(k));
  }
}

// Finds the box in what it is given, once it may; but not in the first frame.
class SlowDetector : public ObjectDetector {
 public:
  explicit SlowDetector(std::latch& go) : go_(go) {}
  std::vector<std::optional<Detection>> detect(const Frame& frame,
                                               std::span<const int> objects) override {
    std::vector<std::optional<Detection>> found(objects.size());
    searched.push_back(frame.index);
    if (searched.size() == 1) return found;
    go_.wait();
    std::fill(found.begin(), found.end(), Detection{shifted(0.01 * frame.index), 0.9, 0.9, 12});
    return found;
  }
  std::vector<int> searched;

 private:
  std::latch& go_;
};

TEST(RealtimePipeline, ATrackerCatchesUpWithTheFramesSinceTheOneThatWasSearched) {
  std::latch go(1);
  auto tracker = trackerWith([](int) {});
  const HookedTracker& fake = *tracker;
  PipelineParts parts = partsOf(Method::kEbt, std::move(tracker));
  parts.objects[0].initial_T_camera_object.reset();
  auto detector = std::make_unique<SlowDetector>(go);
  const SlowDetector& slow = *detector;
  parts.detector = std::move(detector);
  RealtimePipeline pipeline(std::move(parts));
  std::vector<FrameResult> results;
  int k = 0;
  const auto pushOne = [&] {
    pipeline.push(frameAt(k++));
    while (results.size() < static_cast<size_t>(k))
      for (FrameResult& result : pipeline.wait(1s)) results.push_back(std::move(result));
  };
  while (k < 10) pushOne();
  go.count_down();
  while (countEvents(results, "box", "tracked") == 0 && k < 1000) pushOne();
  pipeline.close();
  resultsOf(pipeline);
  // The searched frame again, with a start, and the others up to the newest one; of very many some.
  const auto start = std::find_if(fake.starts_at.begin(), fake.starts_at.end(),
                                  [](const auto& call) { return call.second; });
  ASSERT_NE(start, fake.starts_at.end());
  EXPECT_EQ(start->first, slow.searched.at(1));
  EXPECT_TRUE(std::is_sorted(start, fake.starts_at.end()));
  EXPECT_GT(fake.starts_at.end() - start, 5);
  EXPECT_EQ(fake.starts_at.back().first, k - 1);
  EXPECT_EQ(results.back().objects[0].measurement->timestamp_ns, (k - 1) * kStep_ns);
  EXPECT_TRUE(results.back().objects[0].measurement->claimed);
}

// Finds the box in every frame, but takes its time.
class LateDetector : public ObjectDetector {
 public:
  LateDetector(std::latch& entered, std::latch& go) : entered_(entered), go_(go) {}
  std::vector<std::optional<Detection>> detect(const Frame& frame,
                                               std::span<const int> objects) override {
    entered_.count_down();
    go_.wait();
    return std::vector<std::optional<Detection>>(
        objects.size(), Detection{shifted(0.01 * frame.index), 0.9, 0.9, 12});
  }

 private:
  std::latch &entered_, &go_;
};

TEST(RealtimePipeline, NothingIsLostWhileTheObjectIsLookedForInTheFirstFrame) {
  std::latch entered(1), go(1);
  auto tracker = trackerWith([](int) {});
  const HookedTracker& fake = *tracker;
  PipelineParts parts = partsOf(Method::kFused, std::move(tracker));
  parts.objects[0].initial_T_camera_object.reset();
  parts.detector = std::make_unique<LateDetector>(entered, go);
  RealtimePipeline pipeline(std::move(parts));
  pipeline.push(frameAt(0));
  entered.wait();
  for (int k = 1; k < 40; ++k) pipeline.push(frameAt(k));
  pipeline.close();
  go.count_down();
  const std::vector<FrameResult> results = resultsOf(pipeline);
  ASSERT_EQ(results.size(), 40u);
  for (const FrameResult& result : results) {
    EXPECT_FALSE(result.dropped);
    EXPECT_TRUE(result.objects[0].measurement->claimed);
  }
  ASSERT_EQ(fake.starts_at.size(), 40u);
  EXPECT_TRUE(fake.starts_at[0].second);
}

class CountingSource : public FrameSource {
 public:
  explicit CountingSource(int broken = -1) : broken_(broken) {}
  const Camera& camera() const override { return camera_; }
  int frameCount() const override { return 20; }
  FrameAndTruth read(int index) override {
    if (index == broken_) throw InputError(SourcePlace{"rgb/5.png"}, "no picture", "render again");
    return {*frameAt(index), GroundTruth{}};
  }

 private:
  int broken_;
  Camera camera_;
};

TEST(FrameFeeder, FeedsEachFrameWithItsTruth) {
  CountingSource source;
  RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int) {})));
  std::vector<int> indices(20);
  for (int k = 0; k < 20; ++k) indices[static_cast<size_t>(k)] = k;
  FrameFeeder feeder(source, indices, pipeline);
  const std::vector<FrameResult> results = resultsOf(pipeline);
  ASSERT_EQ(results.size(), 20u);
  for (const FrameResult& result : results) {
    const FrameFeeder::Fed fed = feeder.take();
    EXPECT_EQ(fed.frame->timestamp_ns, result.timestamp_ns);
    EXPECT_TRUE(fed.truth.has_value());
  }
}

TEST(FrameFeeder, APictureThatCannotBeReadEndsTheRun) {
  CountingSource source(5);
  RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int) {})));
  FrameFeeder feeder(source, {3, 4, 5, 6}, pipeline);
  EXPECT_THROW(resultsOf(pipeline), InputError);
}

TEST(FrameFeeder, CanBeLeftAtOnce) {
  CountingSource source;
  RealtimePipeline pipeline(partsOf(Method::kFused, trackerWith([](int) {})));
  FrameFeeder feeder(source, {0, 1, 2, 19}, pipeline);
}

}  // namespace
}  // namespace diorama
