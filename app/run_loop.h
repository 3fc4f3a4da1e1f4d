// The loop of a run: frames in, measurements and estimates out, truth only to the recorder.
#pragma once

#include <memory>
#include <vector>

#include "app/overlay.h"
#include "app/run_recorder.h"
#include "app/run_setup.h"
#include "eval/metrics.h"

namespace diorama {

// What works on the frames; made before anything is written, so that what is wrong with the input
// is said first.
struct Session {
  Session(const RunArguments& arguments, const RunInput& input, int first_frame,
          const RunOptions& options);

  Method method;
  std::vector<ObjectModel> models;
  std::shared_ptr<const RayQuery> rays;
  PipelineParts parts;
  OverlayPainter painter;
};

// Writes everything but metrics.json; throws OutputError, and what the input's frames throw.
Metrics processFrames(const RunArguments& arguments, const RunInput& input,
                      const std::vector<int>& frames, Session& session);

}  // namespace diorama
