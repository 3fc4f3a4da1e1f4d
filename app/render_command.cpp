#include <algorithm>
#include <atomic>
#include <cstdio>
#include <future>
#include <mutex>

#include "app/command_line.h"
#include "app/frame_stream.h"
#include "app/output_folder.h"
#include "app/prefetcher.h"
#include "app/progress.h"
#include "app/run_input.h"
#include "app/workers.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "sim/scene.h"
#include "sim/sequence_writer.h"
#include "sim/simulator.h"

namespace diorama {
namespace {

struct RenderArguments {
  std::string scene, output, renderer = "ray", quality = "standard", format = "tum", frames;
  std::vector<std::string> truth;
  std::vector<std::string> sets;
  std::optional<uint64_t> seed;
  bool resume = false;
};

bool isStream(const RenderArguments& arguments) { return arguments.format == "y4m"; }

// tum, bop and euroc, separated by commas, in any order.
std::vector<SequenceFormat> parseFormats(const std::string& text) {
  constexpr std::pair<const char*, SequenceFormat> kNames[] = {{"tum", SequenceFormat::kTum},
                                                               {"bop", SequenceFormat::kBop},
                                                               {"euroc", SequenceFormat::kEuroc}};
  std::vector<SequenceFormat> formats;
  for (std::string_view part : split(text, ',')) {
    const auto known = std::find_if(std::begin(kNames), std::end(kNames),
                                    [&](const auto& entry) { return part == entry.first; });
    if (known == std::end(kNames))
      throw UsageError("--format " + text + ": possible: tum, bop, euroc (a list), or y4m");
    formats.push_back(known->second);
  }
  return formats;
}

// What a BOP user must know: its tools project with cam_K alone.
void warnOfDistortion(const Scene& scene, const std::vector<SequenceFormat>& formats) {
  const bool bop = std::find(formats.begin(), formats.end(), SequenceFormat::kBop) != formats.end();
  if (bop && scene.camera.model != CameraModel::kPinhole)
    std::fprintf(stderr,
                 "bop: this camera has a %s lens; BOP's tools know cam_K alone "
                 "(`--set camera.model=pinhole --set camera.distortion=[]` films without)\n",
                 toString(scene.camera.model).c_str());
}

RendererKind parseRenderer(const std::string& name) {
  if (name == "ray") return RendererKind::kRay;
  if (name == "raster") return RendererKind::kRaster;
  throw UsageError("--renderer " + name + ": possible: ray, raster");
}

void checkSupported(const RenderArguments& arguments) {
  parseRenderer(arguments.renderer);
  if (isStream(arguments)) {
    if (arguments.resume) throw UsageError("--resume: a stream cannot be gone on with");
  } else {
    parseFormats(arguments.format);
    if (arguments.output == "-")
      throw UsageError("-o -: only --format y4m goes to standard output");
  }
}

struct NamedChannel {
  const char* name;
  bool TruthChannels::*asked;
};
constexpr NamedChannel kChannels[] = {{"normal", &TruthChannels::normal},
                                      {"flow", &TruthChannels::flow},
                                      {"edges", &TruthChannels::edges}};

std::string namesOf(const TruthChannels& channels) {
  std::string names;
  for (const NamedChannel& c : kChannels)
    if (channels.*c.asked) names += (names.empty() ? "" : ", ") + std::string(c.name);
  return names;
}

TruthChannels parseTruth(const std::vector<std::string>& names) {
  TruthChannels channels, all;
  for (const NamedChannel& c : kChannels) all.*c.asked = true;
  for (const std::string& name : names) {
    const auto* channel = std::find_if(std::begin(kChannels), std::end(kChannels),
                                       [&](const NamedChannel& c) { return name == c.name; });
    if (channel == std::end(kChannels))
      throw UsageError("--truth " + name + ": possible: " + namesOf(all));
    channels.*channel->asked = true;
  }
  return channels;
}

std::string recipe(const RenderArguments& arguments, const Scene& scene,
                   const std::vector<int>& frames) {
  return "version: " DIORAMA_VERSION "\nrenderer: " + arguments.renderer +
         "\nquality: " + arguments.quality + "\nformat: " + arguments.format + "\ntruth: [" +
         namesOf(parseTruth(arguments.truth)) + "]\nframes: [" + std::to_string(frames.front()) +
         ", " + std::to_string(frames.back() + 1) + "]\nscene:\n" + indented(describeScene(scene));
}

// Each worker renders and writes whole frames by itself; frames do not depend on one another.
void renderFrames(Simulator& simulator, SequenceWriter& writer, const std::vector<int>& frames) {
  std::vector<int> missing;
  for (int frame : frames)
    if (!writer.has(frame)) missing.push_back(frame);
  Progress progress("rendering", static_cast<int>(missing.size()));
  std::atomic<size_t> next{0}, done{0};
  std::mutex progress_mutex;
  const auto work = [&] {
    while (true) {
      throwIfInterrupted();
      const size_t i = next++;
      if (i >= missing.size()) return;
      try {
        const FrameAndTruth frame = simulator.read(missing[i]);
        writer.write(frame.frame, *frame.truth);
      } catch (...) {
        next = missing.size();  // the other workers stop as well
        throw;
      }
      const std::lock_guard lock(progress_mutex);
      progress.update(static_cast<int>(++done));
    }
  };
  std::vector<std::future<void>> workers;
  for (int i = 0; i < workerCount(); ++i) workers.push_back(std::async(std::launch::async, work));
  for (std::future<void>& worker : workers) worker.wait();
  for (std::future<void>& worker : workers) worker.get();
}

int render(const RenderArguments& arguments) {
  checkSupported(arguments);
  std::vector<YamlOverride> overrides;
  for (const std::string& set : arguments.sets) overrides.push_back(parseOverride(set));
  if (arguments.seed) overrides.push_back(parseOverride("seed=" + std::to_string(*arguments.seed)));
  const Scene scene = loadScene(arguments.scene, overrides);
  const std::vector<int> frames = framesOf(
      parseFrameRange(arguments.frames.empty() ? ":" : arguments.frames), scene.frameCount());
  const RenderOptions options{parseQuality(arguments.quality), 1, parseTruth(arguments.truth),
                              parseRenderer(arguments.renderer), noteBaking};
  if (options.renderer == RendererKind::kRaster && scene.row_time_s > 0)
    throw InputError(arguments.scene,
                     "camera.row_time_s: the raster renderer has no rolling shutter",
                     "use --renderer ray");
  if (isStream(arguments)) {
    Simulator simulator(scene, options);
    streamY4m(simulator, frames, scene.rate_hz, arguments.output);
    return kExitDone;
  }
  const std::vector<SequenceFormat> formats = parseFormats(arguments.format);
  warnOfDistortion(scene, formats);
  const OutputRequest request{
      arguments.output, "render.yaml", "manifest.csv", recipe(arguments, scene, frames), true,
      arguments.resume};
  if (prepareOutput(request) != OutputState::kComplete) {
    Simulator simulator(scene, options);
    SequenceWriter writer(arguments.output, scene, {frames.front(), frames.back() + 1, formats});
    renderFrames(simulator, writer, frames);
    writer.finish();
  }
  std::printf("%s: %zu frames\n", arguments.output.c_str(), frames.size());
  return kExitDone;
}

}  // namespace

std::function<int()> setUpRender(CLI::App& app) {
  auto arguments = std::make_shared<RenderArguments>();
  app.add_option("SCENE", arguments->scene, "scene file (YAML)")->required();
  app.add_option("-o,--output", arguments->output,
                 "sequence folder to write; y4m: a file, or - for a pipe")
      ->required();
  app.add_option("--renderer", arguments->renderer, "ray or raster")->capture_default_str();
  app.add_option("--quality", arguments->quality, "draft, standard or high")->capture_default_str();
  app.add_option("--format", arguments->format, "tum, bop, euroc (a list), or y4m (a video stream)")
      ->capture_default_str();
  app.add_option("--truth", arguments->truth, "more channels: normal,flow,edges")->delimiter(',');
  app.add_option("--frames", arguments->frames, "A:B, zero-based and half-open");
  app.add_option("--seed", arguments->seed, "replaces the scene's seed");
  app.add_option("--set", arguments->sets, "key.path=value: replaces a value of the scene")
      ->allow_extra_args(false);
  app.add_flag("--resume", arguments->resume, "go on with an interrupted sequence");
  return [arguments] { return render(*arguments); };
}

}  // namespace diorama
