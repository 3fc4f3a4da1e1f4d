// A camera that does not exist, moved through a scene that does not exist: frames with exact truth.
#pragma once

#include <memory>

#include "core/frame_source.h"
#include "sim/renderer.h"
#include "sim/scene.h"

namespace diorama {

// read(k) depends on the scene, the quality and k only, not on which frames were read before, nor
// on the number of threads. Constructing reads the models and bakes the light (some seconds the
// first time; kept in cacheFolder()/light); it throws MissingInputError or InputError. One caller
// at a time, or any number with one thread each (options.threads = 1).
class Simulator : public FrameSource {
 public:
  explicit Simulator(Scene scene, RenderOptions options = {});
  ~Simulator() override;

  const Camera& camera() const override;
  int frameCount() const override;
  FrameAndTruth read(int index) override;

  const Scene& scene() const;

  // Optical flow between any two frames, exact, in the imaging model of the pictures.
  FlowField flow(int from, int to);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
