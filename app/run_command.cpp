#include <sys/resource.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/command_line.h"
#include "app/command_text.h"
#include "app/metrics_json.h"
#include "app/output_folder.h"
#include "app/overlay.h"
#include "app/prefetcher.h"
#include "app/progress.h"
#include "app/run_journal.h"
#include "app/run_recorder.h"
#include "app/run_report.h"
#include "app/run_setup.h"
#include "app/video_writer.h"
#include "app/workers.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "eval/table.h"
#include "sim/embree_ray_query.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

std::vector<ObjectModel> modelsOf(const RunInput& input) {
  std::vector<ObjectModel> models;
  for (const KnownObject& object : input.objects) models.push_back(object.model);
  return models;
}

std::string progressDetail(const RunRecorder& recorder, const FrameResult& result,
                           const std::optional<GroundTruth>& truth) {
  std::string detail;
  for (size_t i = 0; i < result.objects.size(); ++i) {
    if (const auto error = recorder.error_m(i))
      detail += "  error " + formatFixed(1e3 * *error, 1) + " mm";
    if (result.objects[i].measurement && !result.objects[i].measurement->claimed)
      detail += " (lost)";
    if (truth && i < truth->objects.size())
      if (const auto visible = truth->objects[i].visibleFraction())
        detail += "  visible " + formatFixed(100 * *visible, 0) + "%";
  }
  return std::string(trim(detail));
}

std::vector<OverlayObject> overlayObjects(const RunRecorder& recorder, const FrameResult& result,
                                          const std::optional<GroundTruth>& truth) {
  std::vector<OverlayObject> objects;
  for (size_t i = 0; i < result.objects.size(); ++i) {
    OverlayObject object;
    object.T_camera_object = result.objects[i].T_camera_object;
    object.T_camera_object_true = recorder.truth(i);
    if (const auto& measurement = result.objects[i].measurement) {
      object.claimed = measurement->claimed;
      object.health = measurement->health;
    }
    if (truth && i < truth->objects.size())
      object.visible_fraction = truth->objects[i].visibleFraction();
    objects.push_back(object);
  }
  return objects;
}

double peakMemoryMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// What was expected, and whether it came; for the report.
std::string verdictJson(const RunArguments& arguments, const Metrics& metrics) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const std::string& text : arguments.expects) {
    const std::string missed = Expectation(text).missed(metrics);
    list.push_back({{"text", text}, {"met", missed.empty()}, {"detail", missed}});
  }
  return list.dump(2) + "\n";
}

void writeReport(const RunArguments& arguments, const Metrics& metrics) {
  const fs::path folder = arguments.output;
  writeFileAtomically(folder / "verdict.json", verdictJson(arguments, metrics));
  if (!arguments.no_report) writeRunReport({folder}, folder / "report.html");
}

int reportMetrics(const RunArguments& arguments, const Metrics& metrics) {
  const fs::path folder = arguments.output;
  std::fputs(formatMetrics(metrics).c_str(), stdout);
  if (!arguments.no_video) std::printf("overlay: %s\n", (folder / "overlay.mp4").c_str());
  if (!arguments.no_report) std::printf("report: %s\n", (folder / "report.html").c_str());
  int code = kExitDone;
  for (const std::string& text : arguments.expects) {
    const std::string missed = Expectation(text).missed(metrics);
    if (missed.empty()) continue;
    std::fprintf(stderr, "%s\n", missed.c_str());
    code = kExitMissed;
  }
  return code;
}

std::vector<Mesh> meshesOf(const std::vector<ObjectModel>& models) {
  std::vector<Mesh> meshes;
  for (const ObjectModel& model : models) meshes.push_back(model.mesh);
  return meshes;
}

// What works on the frames; made before anything is written, so that what is wrong with the input
// is said first.
struct Session {
  Session(const RunArguments& arguments, const RunInput& input, int first_frame,
          const RunOptions& options)
      : method(parseMethod(arguments.method)),
        models(modelsOf(input)),
        rays(std::make_shared<const EmbreeRayQuery>(meshesOf(models))),
        pipeline(method, makeObjects(arguments, input, first_frame, options, rays),
                 method == Method::kEbt ? nullptr : makeOdometry(arguments, input, options),
                 mapperOptions(arguments, options), makeDetector(arguments, input, options, rays),
                 options.pipeline),
        recorder(method, models),
        journal(models),
        painter(input.source->camera(), models, rays) {}

  Method method;
  std::vector<ObjectModel> models;
  std::shared_ptr<const RayQuery> rays;
  Pipeline pipeline;
  RunRecorder recorder;
  RunJournal journal;
  OverlayPainter painter;
};

// The loop: frames in, measurements and estimates out, truth only to the recorder.
Metrics processFrames(const RunArguments& arguments, const RunInput& input,
                      const std::vector<int>& frames, Session& session) {
  const Stopwatch watch;
  const Camera& camera = input.source->camera();
  const fs::path folder = arguments.output;
  std::optional<VideoWriter> video;
  if (!arguments.no_video)
    video.emplace(folder / "overlay.mp4", camera.width(), camera.height(),
                  input.rate_hz / arguments.every);

  RunRecorder& recorder = session.recorder;
  Prefetcher prefetcher(*input.source, frames, workerCount());
  Progress progress("tracking", static_cast<int>(frames.size()));
  for (size_t i = 0; i < frames.size(); ++i) {
    throwIfInterrupted();
    FrameAndTruth next = prefetcher.next();
    next.frame.index =
        static_cast<int>(i);  // the same for a scene and for the sequence made from it
    const FrameResult result = session.pipeline.process(next.frame);
    recorder.add(frames[i], next.frame.timestamp_ns, result, next.truth);
    session.journal.add(frames[i], next.frame.timestamp_ns, result, next.truth);
    if (video)
      video->add(session.painter.paint(next.frame,
                                       arguments.method + "  frame " + std::to_string(frames[i]),
                                       overlayObjects(recorder, result, next.truth)));
    progress.update(static_cast<int>(i + 1), progressDetail(recorder, result, next.truth));
  }

  const Pipeline::Final final = session.pipeline.finish();
  recorder.write(folder, final);
  session.journal.write(folder);
  writeFileAtomically(folder / "command.txt", shellLine(repeatCommand(arguments)) + "\n");
  if (video) video->finish();
  Metrics metrics = recorder.metrics(final);
  metrics.scene = input.name;
  metrics.method = arguments.method;
  metrics.initial = arguments.initial;
  metrics.seed = input.seed;
  metrics.timing.wall_s = watch.seconds();
  metrics.timing.frames_per_s = static_cast<double>(frames.size()) / watch.seconds();
  metrics.timing.render_ms = prefetcher.readMs();
  metrics.timing.dropped_frames = 0;
  metrics.peak_memory_mb = peakMemoryMb();
  return metrics;
}

// A run that fails leaves its folder as it was before.
Metrics processOrUndo(const RunArguments& arguments, const RunInput& input,
                      const std::vector<int>& frames, Session& session) {
  try {
    return processFrames(arguments, input, frames, session);
  } catch (...) {
    std::error_code ignored;
    fs::remove(fs::path(arguments.output) / "run.yaml", ignored);
    fs::remove(arguments.output, ignored);  // when nothing is in it
    throw;
  }
}

int run(const RunArguments& arguments) {
  checkSupported(arguments);
  for (const std::string& expect : arguments.expects)
    Expectation{expect};  // malformed ones fail before the work
  SplitOverrides sets = splitOverrides(arguments.sets);
  if (arguments.seed)
    sets.scene.push_back(parseOverride("seed=" + std::to_string(*arguments.seed)));
  const RunOptions options = readRunOptions(
      arguments.options.empty() ? std::nullopt : std::optional<fs::path>(arguments.options),
      sets.estimators);
  const FrameRange range = parseFrameRange(arguments.frames.empty() ? ":" : arguments.frames);
  const RunInput input = openInput(
      arguments.input, range.begin, sets.scene, {parseQuality(arguments.quality), 1},
      arguments.objects.empty() ? std::nullopt : std::optional<fs::path>(arguments.objects));
  const std::vector<int> frames = framesOf(range, input.source->frameCount(), arguments.every);
  Session session(arguments, input, frames.front(), options);

  const fs::path folder = arguments.output;
  const fs::path metrics_file = folder / "metrics.json";
  OutputRequest request{folder, "run.yaml", "metrics.json",
                        recipe(arguments, input, frames, options)};
  if (prepareOutput(request) == OutputState::kComplete) {
    const Metrics metrics = metricsFromJson(metrics_file);
    const bool judged_anew = !arguments.expects.empty();
    if (judged_anew || !fs::exists(folder / "report.html")) writeReport(arguments, metrics);
    return reportMetrics(arguments, metrics);
  }
  const Metrics metrics = processOrUndo(arguments, input, frames, session);
  writeFileAtomically(metrics_file, toJson(metrics));
  writeReport(arguments, metrics);
  return reportMetrics(arguments, metrics);
}

}  // namespace

std::function<int()> setUpRun(CLI::App& app) {
  auto arguments = std::make_shared<RunArguments>();
  app.add_option("INPUT", arguments->input,
                 "scene file (YAML) or sequence folder (ours, BOP or EuRoC)")
      ->required();
  app.add_option("-o,--output", arguments->output, "run folder to write")->required();
  app.add_option("--method", arguments->method, "vo, ebt or fused")->capture_default_str();
  app.add_option("--initial", arguments->initial,
                 "given: the sequence's initial poses; detect: found in the images")
      ->capture_default_str();
  app.add_option("--odometry", arguments->odometry, "vo, simulated or replay:FILE")
      ->capture_default_str();
  app.add_option("--tracker", arguments->tracker, "edge or replay:FILE (a measurements.csv)")
      ->capture_default_str();
  app.add_option("--quality", arguments->quality, "of a scene's pictures: draft, standard or high")
      ->capture_default_str();
  app.add_option("--frames", arguments->frames, "A:B, zero-based and half-open");
  app.add_option("--every", arguments->every, "use every N-th frame only")->capture_default_str();
  app.add_option("--seed", arguments->seed, "replaces the scene's seed");
  app.add_option("--objects", arguments->objects,
                 "YAML file with the `objects` of a sequence, in place of its own");
  app.add_option("--options", arguments->options, "YAML file with estimator options");
  app.add_option("--set", arguments->sets,
                 "key.path=value: replaces an option of the scene or of an estimator")
      ->allow_extra_args(false);
  app.add_option("--expect", arguments->expects, "'METRIC>=VALUE': exit code 1 when it is missed")
      ->allow_extra_args(false);
  app.add_flag("--no-video", arguments->no_video, "write no overlay.mp4");
  app.add_flag("--no-report", arguments->no_report, "write no report.html");
  return [arguments] { return run(*arguments); };
}

}  // namespace diorama
