// Frames of the scenes through the public calls of the tracker and of the detector, one core;
// rendering and training are not timed.
#include <benchmark/benchmark.h>

#include <opencv2/core/utility.hpp>

#include "app/object_training.h"
#include "sim/embree_ray_query.h"
#include "sim/mesh_import.h"
#include "sim/simulator.h"
#include "tracker/database_detector.h"
#include "tracker/object_tracker.h"

namespace diorama {
namespace {

constexpr int kFrames = 100;

void BM_TrackFrame(benchmark::State& state) {
  Simulator simulator(loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml"));
  const Scene& scene = simulator.scene();
  const SceneObject* tracked = nullptr;
  for (const SceneObject& object : scene.objects)
    if (object.tracked) tracked = &object;
  const ObjectModel model{tracked->name, importMesh(tracked->mesh, {tracked->scale, tracked->y_up}),
                          tracked->symmetries};
  const auto rays = std::make_shared<const EmbreeRayQuery>(std::vector<Mesh>{model.mesh});
  std::vector<Frame> frames;
  for (int k = 0; k < kFrames; ++k) frames.push_back(simulator.read(k).frame);
  const ObjectPrediction start{scene.T_world_camera(0).inverse() * tracked->T_world_object};

  TrackerOptions options;
  options.particles = static_cast<int>(state.range(0));
  EdgeTracker tracker(model, simulator.camera(), rays, 0, options);
  size_t frame = 0;
  for (auto _ : state) {
    const auto given = frame == 0 ? std::optional(start) : std::nullopt;
    benchmark::DoNotOptimize(tracker.track(frames[frame], given));
    frame = (frame + 1) % kFrames;
  }
}

BENCHMARK(BM_TrackFrame)
    ->ArgName("particles")
    ->Arg(1)
    ->Arg(20)
    ->Iterations(10 * kFrames)
    ->Unit(benchmark::kMillisecond);

// All three objects of scenes/multi_object.yaml in one image, as if nothing were known.
void BM_Detect(benchmark::State& state) {
  cv::setNumThreads(1);
  Simulator simulator(loadScene(DIORAMA_SOURCE_DIR "/scenes/multi_object.yaml"));
  std::vector<DetectorObject> objects;
  std::vector<Mesh> meshes;
  std::vector<int> wanted;
  for (const SceneObject& object : simulator.scene().objects) {
    if (!object.tracked) continue;
    ObjectModel model{object.name, importMesh(object.mesh, {object.scale, object.y_up}),
                      object.symmetries};
    meshes.push_back(model.mesh);
    wanted.push_back(static_cast<int>(wanted.size()));
    ObjectDatabase database =
        trainOrRemember({object.mesh, object.scale, object.y_up}, model, TrainingOptions{});
    objects.push_back({std::move(model), std::move(database)});
  }
  std::vector<Frame> frames;
  for (int k = 0; k < kFrames; ++k) frames.push_back(simulator.read(k).frame);
  DatabaseDetector detector(std::move(objects), simulator.camera(),
                            std::make_shared<const EmbreeRayQuery>(meshes));
  size_t frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(detector.detect(frames[frame], wanted));
    frame = (frame + 1) % kFrames;
  }
}

BENCHMARK(BM_Detect)->Iterations(kFrames)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
