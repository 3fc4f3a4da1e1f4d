// Consecutive frames of scenes/orange_juice.yaml through the two calls of the visual odometry, one
// core. Rendering, the start and the object's detection are not timed.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "sim/simulator.h"
#include "vo/odometry.h"

namespace diorama {
namespace {

constexpr int kFrames = 300;  // with new keyframes all along; then a new odometry starts over

struct Recording {
  std::unique_ptr<Simulator> simulator;
  std::vector<Frame> frames;
  std::vector<ObjectMeasurement> objects;  // one per frame: the tracked object at its true pose
};

ObjectMeasurement measured(const SE3& T_camera_object, const Frame& frame) {
  constexpr double kSigmaM = 1e-3, kSigmaRad = 2e-3;
  ObjectMeasurement m;
  m.source = "truth";
  m.object = "orange_juice";
  m.timestamp_ns = frame.timestamp_ns;
  m.T_camera_object = T_camera_object;
  m.covariance.setZero();
  m.covariance.diagonal() << Vector3d::Constant(kSigmaM * kSigmaM),
      Vector3d::Constant(kSigmaRad * kSigmaRad);
  m.health = 1;
  m.claimed = true;
  return m;
}

// Rendered once for both benchmarks.
const Recording& recording() {
  static const Recording made = [] {
    Recording r;
    r.simulator =
        std::make_unique<Simulator>(loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml"),
                                    RenderOptions{.quality = RenderQuality::kDraft});
    const Scene& scene = r.simulator->scene();
    const auto tracked = std::find_if(scene.objects.begin(), scene.objects.end(),
                                      [](const SceneObject& object) { return object.tracked; });
    for (int k = 0; k < kFrames; ++k) {
      const Frame rendered = r.simulator->read(k).frame;
      Frame frame;
      frame.index = rendered.index;
      frame.timestamp_ns = rendered.timestamp_ns;
      frame.gray = rendered.gray;
      r.objects.push_back(
          measured(scene.T_world_camera(k).inverse() * tracked->T_world_object, frame));
      r.frames.push_back(std::move(frame));
    }
    return r;
  }();
  return made;
}

struct Times {
  double track_s = 0, update_s = 0;
};

// Plays the recording again and again; each next() is one frame of a started odometry.
class Player {
 public:
  Times next() {
    if (frame_ == static_cast<size_t>(kFrames)) frame_ = 0;
    if (frame_ == 0) odometry_ = std::make_unique<VisualOdometry>(recording().simulator->camera());
    while (!odometry_->started() && frame_ + 1 < static_cast<size_t>(kFrames)) play();
    return play();
  }

 private:
  Times play() {
    const auto begin = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(odometry_->track(recording().frames[frame_]));
    const auto middle = std::chrono::steady_clock::now();
    const bool wanted = odometry_->wantsObjects();
    odometry_->update(std::span(&recording().objects[frame_], wanted ? 1 : 0));
    const auto end = std::chrono::steady_clock::now();
    ++frame_;
    return {std::chrono::duration<double>(middle - begin).count(),
            std::chrono::duration<double>(end - middle).count()};
  }

  std::unique_ptr<VisualOdometry> odometry_;
  size_t frame_ = 0;
};

void play(benchmark::State& state, double Times::*part) {
  recording();
  Player player;
  double worst = 0;
  for (auto _ : state) {
    const double seconds = player.next().*part;
    worst = std::max(worst, seconds);
    state.SetIterationTime(seconds);
  }
  state.counters["worst_ms"] = 1e3 * worst;
}

// Motion estimation: what must be done before the next frame comes.
void BM_VoFrame(benchmark::State& state) { play(state, &Times::track_s); }
// The second worker: depths, keyframes and bundle adjustment, spread over all frames.
void BM_VoMapping(benchmark::State& state) { play(state, &Times::update_s); }

BENCHMARK(BM_VoFrame)->Iterations(2 * kFrames)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_VoMapping)->Iterations(2 * kFrames)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
