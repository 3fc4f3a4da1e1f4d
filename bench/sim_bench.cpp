// Frames of scenes/orange_juice.yaml with all truth channels, on all cores, real time.
#include <benchmark/benchmark.h>

#include "sim/mesh_import.h"
#include "sim/simulator.h"

namespace diorama {
namespace {

constexpr int kFrames = 100;

double trianglesOf(const Scene& scene) {
  size_t count = importMesh(scene.environment_mesh).triangles.size();
  for (const SceneObject& object : scene.objects) count += importMesh(object.mesh).triangles.size();
  return static_cast<double>(count);
}

void BM_RenderFrame(benchmark::State& state, RenderQuality quality,
                    RendererKind renderer = RendererKind::kRay) {
  const Scene scene = loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml");
  Simulator simulator(scene, {.quality = quality, .renderer = renderer});
  state.counters["triangles"] = trianglesOf(scene);
  int frame = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(simulator.read(frame));
    frame = (frame + 1) % kFrames;
  }
}

BENCHMARK_CAPTURE(BM_RenderFrame, ray_draft, RenderQuality::kDraft)
    ->Iterations(2 * kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_RenderFrame, ray_standard, RenderQuality::kStandard)
    ->Iterations(kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_RenderFrame, ray_high, RenderQuality::kHigh)
    ->Iterations(kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_RenderFrame, raster_draft, RenderQuality::kDraft, RendererKind::kRaster)
    ->Iterations(kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_RenderFrame, raster_standard, RenderQuality::kStandard, RendererKind::kRaster)
    ->Iterations(kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_RenderFrame, raster_high, RenderQuality::kHigh, RendererKind::kRaster)
    ->Iterations(kFrames)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
