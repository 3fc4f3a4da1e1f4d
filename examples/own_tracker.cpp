// A tracker of your own against exact truth: here one that believes the object stands still.
#include <cstdio>
#include <optional>

#include "core/errors.h"
#include "sim/simulator.h"

using namespace diorama;

struct MyTracker {
  SE3 T_camera_object;
  SE3 track(const Frame&) { return T_camera_object; }  // frame.gray, frame.rgb, frame.timestamp_ns
};

int main(int argc, char** argv) try {
  Simulator simulator(loadScene(argc > 1 ? argv[1] : "scenes/orange_juice.yaml"),
                      {RenderQuality::kDraft});
  std::optional<MyTracker> tracker;
  for (int k = 0; k < 10; ++k) {
    const FrameAndTruth next = simulator.read(k);
    const SE3 truth =
        next.truth->T_world_camera.inverse() * next.truth->objects.at(0).T_world_object;
    if (!tracker) tracker = MyTracker{truth};
    const SE3 estimate = tracker->track(next.frame);
    std::printf("frame %d: off by %.1f mm\n", k,
                1e3 * (estimate.translation - truth.translation).norm());
  }
} catch (const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.code();
}
