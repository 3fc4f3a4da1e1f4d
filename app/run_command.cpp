#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/command_line.h"
#include "app/metrics_json.h"
#include "app/output_folder.h"
#include "app/progress.h"
#include "app/run_loop.h"
#include "app/run_report.h"
#include "app/run_setup.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "eval/table.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMetricsFile = "metrics.json";

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

// A table of dashes does not say what is wrong.
void reportWhatNeverWas(const RunArguments& arguments, const Metrics& metrics) {
  const fs::path events = fs::path(arguments.output) / "events.csv";
  for (const auto& [name, object] : metrics.objects)
    if (arguments.method != "vo" && object.claimed_ratio == 0.0)
      std::fprintf(stderr, "%s was never held; %s says why\n", name.c_str(), events.c_str());
  if (arguments.method != "ebt" && !metrics.start_frame)
    std::fprintf(stderr, "there was no estimate of the camera; %s says why\n", events.c_str());
}

int reportMetrics(const RunArguments& arguments, const Metrics& metrics) {
  const fs::path folder = arguments.output;
  std::fputs(formatMetrics(metrics).c_str(), stdout);
  reportWhatNeverWas(arguments, metrics);
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

// What is not there fails before the work.
void checkExpectations(const RunArguments& arguments, const RunInput& input) {
  Metrics metrics;
  for (const KnownObject& object : input.objects)
    metrics.objects.push_back({object.model.name, {}});
  for (const std::string& expect : arguments.expects) Expectation(expect).check(metrics);
}

// A run that fails leaves nothing: its folder was empty before.
Metrics processOrUndo(const RunArguments& arguments, const RunInput& input,
                      const std::vector<int>& frames, Session& session) {
  const fs::path folder = arguments.output;
  try {
    const Metrics metrics = processFrames(arguments, input, frames, session);
    writeFileAtomically(folder / kMetricsFile, toJson(metrics));
    return metrics;
  } catch (...) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    throw;
  }
}

int run(const RunArguments& arguments) {
  checkSupported(arguments);
  SplitOverrides sets = splitOverrides(arguments.sets);
  if (arguments.seed)
    sets.scene.push_back(parseOverride("seed=" + std::to_string(*arguments.seed)));
  const RunOptions options = readRunOptions(
      arguments.options.empty() ? std::nullopt : std::optional<fs::path>(arguments.options),
      sets.estimators);
  if (arguments.realtime &&
      (options.pipeline.latency_s.tracker > 0 || options.pipeline.latency_s.odometry > 0))
    throw UsageError(
        "--realtime: pipeline.latency_s is for runs in lock-step; leave out one of them");
  const FrameRange range = parseFrameRange(arguments.frames.empty() ? ":" : arguments.frames);
  const RunInput input = openInput(
      arguments.input, range.begin, sets.scene,
      {parseQuality(arguments.quality), 1, {}, RendererKind::kRay, noteBaking},
      arguments.objects.empty() ? std::nullopt : std::optional<fs::path>(arguments.objects));
  checkExpectations(arguments, input);
  const std::vector<int> frames = framesOf(range, input.source->frameCount(), arguments.every);
  Session session(arguments, input, frames.front(), options);

  const fs::path folder = arguments.output;
  OutputRequest request{folder, "run.yaml", kMetricsFile,
                        recipe(arguments, input, frames, options)};
  if (prepareOutput(request) == OutputState::kComplete) {
    const Metrics metrics = metricsFromJson(folder / kMetricsFile);
    const bool judged_anew = !arguments.expects.empty();
    if (judged_anew || !fs::exists(folder / "report.html")) writeReport(arguments, metrics);
    return reportMetrics(arguments, metrics);
  }
  const Metrics metrics = processOrUndo(arguments, input, frames, session);
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
  app.add_option("--odometry", arguments->odometry,
                 "vo, simulated or replay:FILE; several with commas: the first that measures leads")
      ->capture_default_str();
  app.add_option("--tracker", arguments->tracker,
                 "edge or replay:FILE (a measurements.csv); several with commas: the first that "
                 "holds it leads")
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
  app.add_flag("--realtime", arguments->realtime,
               "frames come at their own pace, and what is behind drops them");
  app.add_flag("--no-video", arguments->no_video, "write no overlay.mp4");
  app.add_flag("--no-report", arguments->no_report, "write no report.html");
  return [arguments] { return run(*arguments); };
}

}  // namespace diorama
