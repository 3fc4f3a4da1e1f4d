// Frames of scenes/orange_juice.yaml through the tracker's public call, one core; rendering is not
// timed.
#include <benchmark/benchmark.h>

#include "sim/embree_ray_query.h"
#include "sim/mesh_import.h"
#include "sim/simulator.h"
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

  EdgeTracker tracker(model, simulator.camera(), rays, 0);
  size_t frame = 0;
  for (auto _ : state) {
    const auto given = frame == 0 ? std::optional(start) : std::nullopt;
    benchmark::DoNotOptimize(tracker.track(frames[frame], given));
    frame = (frame + 1) % kFrames;
  }
}

BENCHMARK(BM_TrackFrame)
    ->Name("BM_TrackFrame/particles:1")
    ->Iterations(10 * kFrames)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
