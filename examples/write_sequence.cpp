// A sequence on disk: pictures, and all the truth that goes with them.
#include <algorithm>
#include <cstdio>

#include "core/errors.h"
#include "sim/sequence_writer.h"
#include "sim/simulator.h"

using namespace diorama;

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: write_sequence SCENE.yaml FOLDER\n");
    return 2;
  }
  const Scene scene = loadScene(argv[1]);
  RenderOptions options;
  options.quality = RenderQuality::kDraft;
  options.truth = {.normal = true, .flow = true, .edges = true};  // cost time: off by default
  Simulator simulator(scene, options);
  const int end = std::min(5, scene.frameCount());
  SequenceWriter writer(argv[2], scene, {.first_frame = 0, .end_frame = end});
  for (int k = 0; k < end; ++k) {
    const FrameAndTruth next = simulator.read(k);
    writer.write(next.frame, *next.truth);
    std::printf("frame %d: %zu visible parts of edges\n", k, next.truth->edges->size());
  }
  writer.finish();
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.code();
}
