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

// Frames of a scene and its tracked objects.
struct Film {
  explicit Film(const std::string& scene_name)
      : simulator(loadScene(DIORAMA_SOURCE_DIR "/scenes/" + scene_name)) {
    const Scene& scene = simulator.scene();
    for (const SceneObject& object : scene.objects) {
      if (!object.tracked) continue;
      models.push_back(
          {object.name, importMesh(object.mesh, {object.scale, object.y_up}), object.symmetries});
      meshes.push_back(models.back().mesh);
      starts.push_back({scene.T_world_camera(0).inverse() * object.T_world_object});
    }
    for (int k = 0; k < kFrames; ++k) frames.push_back(simulator.read(k).frame);
  }

  Simulator simulator;
  std::vector<ObjectModel> models;
  std::vector<Mesh> meshes;
  std::vector<ObjectPrediction> starts;  // at the first frame
  std::vector<Frame> frames;
};

// The given objects of a film, frame by frame, again and again.
void track(benchmark::State& state, const Film& film, const std::vector<size_t>& objects,
           const TrackerOptions& options) {
  const auto rays = std::make_shared<const EmbreeRayQuery>(film.meshes);
  std::vector<std::unique_ptr<EdgeTracker>> trackers;
  for (const size_t i : objects)
    trackers.push_back(std::make_unique<EdgeTracker>(film.models[i], film.simulator.camera(), rays,
                                                     static_cast<int>(i), options));
  size_t frame = 0;
  for (auto _ : state) {
    for (size_t k = 0; k < objects.size(); ++k) {
      const auto given = frame == 0 ? std::optional(film.starts[objects[k]]) : std::nullopt;
      benchmark::DoNotOptimize(trackers[k]->track(film.frames[frame], given));
    }
    frame = (frame + 1) % kFrames;
  }
}

void BM_TrackFrame(benchmark::State& state) {
  TrackerOptions options;
  options.particles = static_cast<int>(state.range(0));
  track(state, Film("orange_juice.yaml"), {0}, options);
}

BENCHMARK(BM_TrackFrame)
    ->ArgName("particles")
    ->Arg(1)
    ->Arg(20)
    ->Iterations(10 * kFrames)
    ->Unit(benchmark::kMillisecond);

// The first, the second and the third object of scenes/multi_object.yaml; then all of them.
void BM_TrackObjects(benchmark::State& state) {
  static const Film film("multi_object.yaml");
  const auto one = static_cast<size_t>(state.range(0));
  if (one < film.models.size()) return track(state, film, {one}, {});
  track(state, film, {0, 1, 2}, {});
}

BENCHMARK(BM_TrackObjects)
    ->ArgName("object")
    ->DenseRange(0, 3)
    ->Iterations(5 * kFrames)
    ->Unit(benchmark::kMillisecond);

// All three objects of scenes/multi_object.yaml in one image, as if nothing were known.
void BM_Detect(benchmark::State& state) {
  cv::setNumThreads(1);
  const Film film("multi_object.yaml");
  std::vector<DetectorObject> objects;
  std::vector<int> wanted;
  for (const SceneObject& object : film.simulator.scene().objects) {
    if (!object.tracked) continue;
    const ObjectModel& model = film.models[objects.size()];
    wanted.push_back(static_cast<int>(objects.size()));
    objects.push_back({model, trainOrRemember({object.mesh, object.scale, object.y_up}, model,
                                              TrainingOptions{})});
  }
  DatabaseDetector detector(std::move(objects), film.simulator.camera(),
                            std::make_shared<const EmbreeRayQuery>(film.meshes));
  size_t frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(detector.detect(film.frames[frame], wanted));
    frame = (frame + 1) % kFrames;
  }
}

BENCHMARK(BM_Detect)->Iterations(kFrames)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
