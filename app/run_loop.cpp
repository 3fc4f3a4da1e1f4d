#include "app/run_loop.h"

#include <sys/resource.h>

#include <cstdio>
#include <deque>

#include "app/command_line.h"
#include "app/command_text.h"
#include "app/frame_feeder.h"
#include "app/pipeline.h"
#include "app/prefetcher.h"
#include "app/progress.h"
#include "app/realtime_pipeline.h"
#include "app/stopwatch.h"
#include "app/video_writer.h"
#include "app/workers.h"
#include "core/files.h"
#include "core/text.h"
#include "sim/embree_ray_query.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kWorthMentioning_s = 0.1;

std::vector<ObjectModel> modelsOf(const RunInput& input) {
  std::vector<ObjectModel> models;
  for (const KnownObject& object : input.objects) models.push_back(object.model);
  return models;
}

std::vector<Mesh> meshesOf(const std::vector<ObjectModel>& models) {
  std::vector<Mesh> meshes;
  for (const ObjectModel& model : models) meshes.push_back(model.mesh);
  return meshes;
}

std::string progressDetail(const FrameResult& result, const std::vector<JudgedObject>& judged) {
  std::string detail;
  for (size_t i = 0; i < result.objects.size(); ++i) {
    if (judged[i].error)
      detail += "  error " + formatFixed(1e3 * judged[i].error->translation_m, 1) + " mm";
    if (result.objects[i].measurement && !result.objects[i].measurement->claimed)
      detail += " (lost)";
    if (judged[i].visible_fraction)
      detail += "  visible " + formatFixed(100 * *judged[i].visible_fraction, 0) + "%";
  }
  return std::string(trim(detail));
}

std::vector<OverlayObject> overlayObjects(const FrameResult& result,
                                          const std::vector<JudgedObject>& judged) {
  std::vector<OverlayObject> objects;
  for (size_t i = 0; i < result.objects.size(); ++i) {
    OverlayObject object;
    object.T_camera_object = result.objects[i].T_camera_object;
    object.T_camera_object_true = judged[i].truth;
    object.visible_fraction = judged[i].visible_fraction;
    if (const auto& measurement = result.objects[i].measurement) {
      object.claimed = measurement->claimed;
      object.health = measurement->health;
    }
    objects.push_back(object);
  }
  return objects;
}

double peakMemoryMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// What is done with the results, in the order of the frames.
class Output {
 public:
  Output(const RunArguments& arguments, const RunInput& input, const std::vector<int>& frames,
         Session& session)
      : arguments_(arguments),
        frames_(frames),
        session_(session),
        recorder_(session.method, session.models, arguments.output),
        progress_("tracking", static_cast<int>(frames.size())) {
    const Camera& camera = input.source->camera();
    if (!arguments.no_video)
      video_.emplace(fs::path(arguments.output) / "overlay.mp4", camera.width(), camera.height(),
                     input.rate_hz / arguments.every);
  }

  // A result, and the frame that it belongs to.
  void add(const FrameResult& result, const Frame& frame, const std::optional<GroundTruth>& truth) {
    const int number = frames_[done_++];
    recorder_.add(number, result.timestamp_ns, result, truth);
    if (video_)
      video_->add(session_.painter.paint(frame,
                                         arguments_.method + "  frame " + std::to_string(number),
                                         overlayObjects(result, recorder_.judged())));
    dropped_ += result.dropped ? 1 : 0;
    progress_.update(static_cast<int>(done_), progressDetail(result, recorder_.judged()));
  }

  Metrics finish(const FinalEstimate& final) {
    const fs::path folder = arguments_.output;
    recorder_.finish(final);
    writeFileAtomically(folder / "command.txt", shellLine(repeatCommand(arguments_)) + "\n");
    if (video_) video_->finish();
    return recorder_.metrics(final);
  }

  int dropped() const { return dropped_; }

 private:
  const RunArguments& arguments_;
  const std::vector<int>& frames_;
  Session& session_;
  RunRecorder recorder_;
  Progress progress_;
  std::optional<VideoWriter> video_;
  size_t done_ = 0;
  int dropped_ = 0;
};

struct Ended {
  FinalEstimate final;
  double read_ms = 0;  // of a frame
  double late_s = 0;   // the frames, in real time
};

// One frame after the other, as fast as it goes.
Ended runInLockStep(const RunInput& input, const std::vector<int>& frames, PipelineParts&& parts,
                    Output& output) {
  Pipeline pipeline(std::move(parts));
  Prefetcher prefetcher(*input.source, frames, workerCount());
  std::deque<FrameAndTruth> waiting;  // for their results
  const auto put = [&](const std::vector<FrameResult>& results) {
    for (const FrameResult& result : results) {
      output.add(result, waiting.front().frame, waiting.front().truth);
      waiting.pop_front();
    }
  };
  for (size_t i = 0; i < frames.size(); ++i) {
    throwIfInterrupted();
    waiting.push_back(prefetcher.next());
    // The same for a scene and for the sequence made from it.
    waiting.back().frame.index = static_cast<int>(i);
    put(pipeline.process(waiting.back().frame));
  }
  put(pipeline.drain());
  return {pipeline.finish(), prefetcher.readMs(), 0};
}

// At the pace of the time stamps; what is behind drops frames.
Ended runInRealTime(const RunInput& input, const std::vector<int>& frames, PipelineParts&& parts,
                    Output& output) {
  RealtimePipeline pipeline(std::move(parts));
  FrameFeeder feeder(*input.source, frames, pipeline);
  while (!pipeline.ended()) {
    throwIfInterrupted();
    for (const FrameResult& result : pipeline.wait(std::chrono::milliseconds(100))) {
      const FrameFeeder::Fed fed = feeder.take();
      output.add(result, *fed.frame, fed.truth);
    }
  }
  return {pipeline.finish(), feeder.readMs(), feeder.late_s()};
}

void sayWhenLate(double late_s) {
  if (late_s < kWorthMentioning_s) return;
  std::fprintf(stderr,
               "--realtime: the frames came %.1f s later than their time stamps, since reading or "
               "drawing them took so long; render a scene first for its full pace\n",
               late_s);
}

}  // namespace

Session::Session(const RunArguments& arguments, const RunInput& input, int first_frame,
                 const RunOptions& options)
    : method(parseMethod(arguments.method)),
      models(modelsOf(input)),
      rays(std::make_shared<const EmbreeRayQuery>(meshesOf(models))),
      parts{method,
            makeObjects(arguments, input, first_frame, options, rays),
            method == Method::kEbt ? nullptr : makeOdometry(arguments, input, options, rays),
            makeDetector(arguments, input, options, rays),
            mapperOptions(arguments, options),
            options.pipeline},
      painter(input.source->camera(), models, rays) {}

Metrics processFrames(const RunArguments& arguments, const RunInput& input,
                      const std::vector<int>& frames, Session& session) {
  const Stopwatch watch;
  Output output(arguments, input, frames, session);
  const auto run = arguments.realtime ? runInRealTime : runInLockStep;
  const Ended ended = run(input, frames, std::move(session.parts), output);
  Metrics metrics = output.finish(ended.final);
  sayWhenLate(ended.late_s);
  metrics.scene = input.name;
  metrics.method = arguments.method;
  metrics.initial = arguments.initial;
  metrics.seed = input.seed;
  metrics.timing.wall_s = watch.seconds();
  metrics.timing.frames_per_s = static_cast<double>(frames.size()) / watch.seconds();
  metrics.timing.render_ms = ended.read_ms;
  metrics.timing.dropped_frames = output.dropped();
  metrics.peak_memory_mb = peakMemoryMb();
  return metrics;
}

}  // namespace diorama
