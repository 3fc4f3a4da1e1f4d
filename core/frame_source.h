// Where frames come from: a simulator, or a sequence on disk.
#pragma once

#include <optional>

#include "core/camera.h"
#include "core/frame.h"
#include "core/ground_truth.h"

namespace diorama {

// A frame and, kept apart from it, what is known to be true; only evaluation may look at the
// latter.
struct FrameAndTruth {
  Frame frame;
  std::optional<GroundTruth> truth;
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;
  virtual const Camera& camera() const = 0;
  virtual int frameCount() const = 0;
  // Frame `index` in [0, frameCount()); throws InputError when it cannot be read. Sources that are
  // read ahead allow calls from several threads.
  virtual FrameAndTruth read(int index) = 0;
};

}  // namespace diorama
