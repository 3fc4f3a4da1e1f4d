#include "app/run_setup.h"

#include <algorithm>
#include <functional>
#include <map>

#include "app/odometry_relay.h"
#include "app/replay_odometry.h"
#include "app/replay_tracker.h"
#include "app/tracker_relay.h"
#include "core/errors.h"
#include "core/measurements_io.h"
#include "core/text.h"
#include "tracker/database_detector.h"
#include "tracker/object_tracker.h"
#include "vo/odometry.h"

namespace diorama {
namespace fs = std::filesystem;

namespace {

// Of `replay:FILE`.
std::optional<fs::path> replayFile(const std::string& name) {
  constexpr std::string_view replay = "replay:";
  if (!name.starts_with(replay)) return std::nullopt;
  return name.substr(replay.size());
}

// `vo,simulated`: in the order of preference.
std::vector<std::string> namesIn(const std::string& list) {
  std::vector<std::string> names;
  for (const std::string_view name : split(list, ',')) names.emplace_back(name);
  return names;
}

bool isIn(const std::string& list, const std::string& name) {
  const std::vector<std::string> names = namesIn(list);
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

Method parseMethod(const std::string& name) {
  if (name == "vo") return Method::kVo;
  if (name == "ebt") return Method::kEbt;
  if (name == "fused") return Method::kFused;
  throw UsageError("--method " + name + ": possible: vo, ebt, fused");
}

void checkSupported(const RunArguments& arguments) {
  parseMethod(arguments.method);
  if (arguments.initial != "given" && arguments.initial != "detect")
    throw UsageError("--initial " + arguments.initial + ": possible: given, detect");
  for (const std::string& name : namesIn(arguments.tracker))
    if (name != "edge" && !replayFile(name))
      throw UsageError("--tracker " + name +
                       ": possible: edge, replay:FILE, or several with commas between");
  if (arguments.every < 1) throw UsageError("--every must be at least 1");
}

namespace {

bool usesVisualOdometry(const RunArguments& arguments) { return isIn(arguments.odometry, "vo"); }

std::vector<std::string> namesOf(const RunInput& input) {
  std::vector<std::string> names;
  for (const KnownObject& object : input.objects) names.push_back(object.model.name);
  return names;
}

std::unique_ptr<Odometry> makeOdometry(const std::string& name, const RunArguments& arguments,
                                       const RunInput& input, const RunOptions& options,
                                       const std::shared_ptr<const RayQuery>& rays) {
  if (const auto file = replayFile(name)) {
    std::vector<OdometryMeasurement> steps = readMeasurements(*file).odometry;
    if (steps.empty()) throw InputError(*file, "there is no odometry in it");
    return std::make_unique<ReplayOdometry>(std::move(steps), "replay");
  }
  if (name == "vo")
    return std::make_unique<VisualOdometry>(input.source->camera(), options.vo, "vo",
                                            KnownShapes{rays, namesOf(input)});
  if (name != "simulated")
    throw UsageError("--odometry " + name +
                     ": possible: vo, simulated, replay:FILE, or several with commas between");
  if (!input.simulated_odometry)
    throw InputError(fs::path(arguments.input),
                     "there is no simulated odometry (odometry.csv) in this sequence",
                     "use --odometry vo, --odometry replay:FILE or --method ebt");
  return std::make_unique<ReplayOdometry>(*input.simulated_odometry, "simulated");
}

}  // namespace

std::unique_ptr<Odometry> makeOdometry(const RunArguments& arguments, const RunInput& input,
                                       const RunOptions& options,
                                       const std::shared_ptr<const RayQuery>& rays) {
  std::vector<OdometryRelay::Runner> runners;
  for (const std::string& name : namesIn(arguments.odometry))
    runners.push_back({name, makeOdometry(name, arguments, input, options, rays)});
  if (runners.size() == 1) return std::move(runners.front().odometry);
  return std::make_unique<OdometryRelay>(std::move(runners));
}

namespace {

SE3 givenPose(const RunArguments& arguments, const RunInput& input, const KnownObject& known,
              int first_frame) {
  if (!known.initial_T_camera_object)
    throw InputError(fs::path(arguments.input),
                     "object `" + known.model.name + "` has no initial pose",
                     "use --initial detect, or add initial_T_camera_object to sequence.yaml");
  if (first_frame != input.initial_frame)
    throw UsageError("--frames: the initial poses belong to frame " +
                     std::to_string(input.initial_frame) +
                     ", the run must start there (or use --initial detect)");
  return *known.initial_T_camera_object;
}

// What the files say that trackers replay.
using Recordings = std::map<std::string, Measurements>;  // by the tracker's name

Recordings recordingsOf(const RunArguments& arguments, const RunInput& input) {
  Recordings recordings;
  const std::vector<std::string> wanted = namesOf(input);
  for (const std::string& name : namesIn(arguments.tracker)) {
    const auto file = replayFile(name);
    if (!file) continue;
    const Measurements& found = recordings[name] = readMeasurements(*file);
    const auto isWanted = [&](const ObjectMeasurement& m) {
      return std::find(wanted.begin(), wanted.end(), m.object) != wanted.end();
    };
    if (std::none_of(found.objects.begin(), found.objects.end(), isWanted))
      throw InputError(*file, "it measures none of the objects",
                       found.objects.empty() ? "there is no object in it"
                                             : "it has `" + found.objects.front().object + "`");
  }
  return recordings;
}

SE3 firstRecordedPose(const Recordings& recordings, const std::string& object) {
  for (const auto& [name, recorded] : recordings)
    if (const auto pose = ReplayTracker(recorded.objects, object, "replay").firstPose())
      return *pose;
  return SE3{};
}

std::unique_ptr<ObjectTracker> makeTracker(
    const RunArguments& arguments, const Recordings& recordings, const KnownObject& known,
    const std::function<std::unique_ptr<ObjectTracker>()>& makeEdgeTracker) {
  std::vector<std::unique_ptr<ObjectTracker>> trackers;
  for (const std::string& name : namesIn(arguments.tracker)) {
    const auto recorded = recordings.find(name);
    if (recorded == recordings.end())
      trackers.push_back(makeEdgeTracker());
    else
      trackers.push_back(
          std::make_unique<ReplayTracker>(recorded->second.objects, known.model.name, "replay"));
  }
  if (trackers.size() == 1) return std::move(trackers.front());
  return std::make_unique<TrackerRelay>(std::move(trackers));
}

}  // namespace

std::vector<PipelineObject> makeObjects(const RunArguments& arguments, const RunInput& input,
                                        int first_frame, const RunOptions& options,
                                        const std::shared_ptr<const RayQuery>& rays) {
  std::vector<PipelineObject> objects;
  const Recordings recorded = recordingsOf(arguments, input);
  for (size_t i = 0; i < input.objects.size(); ++i) {
    const KnownObject& known = input.objects[i];
    PipelineObject object{known.model.name, nullptr, std::nullopt, known.model.symmetries};
    if (!isIn(arguments.tracker, "edge"))
      object.initial_T_camera_object = firstRecordedPose(recorded, known.model.name);
    else if (arguments.initial == "given")
      object.initial_T_camera_object = givenPose(arguments, input, known, first_frame);
    if (parseMethod(arguments.method) != Method::kVo || usesVisualOdometry(arguments) ||
        !isIn(arguments.tracker, "edge"))
      object.tracker = makeTracker(arguments, recorded, known, [&] {
        return std::make_unique<EdgeTracker>(known.model, input.source->camera(), rays,
                                             static_cast<int>(i), options.tracker, "edge");
      });
    objects.push_back(std::move(object));
  }
  if (objects.empty())
    throw InputError(fs::path(arguments.input), "there is no object to track",
                     "mark one with `track: true`");
  return objects;
}

MapperOptions mapperOptions(const RunArguments& arguments, const RunOptions& options) {
  MapperOptions mapper = options.mapper;
  if (!usesVisualOdometry(arguments)) return mapper;
  mapper.object_sigma_scale *= options.pipeline.object_sigma_scale_with_vo;
  if (mapper.odometry_memory_s == 0)
    mapper.odometry_memory_s = options.pipeline.odometry_memory_with_vo_s;
  if (mapper.odometry_scale_sigma == 0)
    mapper.odometry_scale_sigma = options.pipeline.odometry_scale_sigma_with_vo;
  if (mapper.odometry_with_map.empty()) mapper.odometry_with_map = "vo";
  return mapper;
}

std::unique_ptr<ObjectDetector> makeDetector(const RunArguments& arguments, const RunInput& input,
                                             const RunOptions& options,
                                             const std::shared_ptr<const RayQuery>& rays) {
  if (arguments.initial != "detect" || !isIn(arguments.tracker, "edge")) return nullptr;
  std::vector<DetectorObject> objects;
  for (const KnownObject& known : input.objects)
    objects.push_back(
        {known.model, known.database ? readDatabase(*known.database)
                                     : trainOrRemember(known.file, known.model, options.training)});
  return std::make_unique<DatabaseDetector>(std::move(objects), input.source->camera(), rays,
                                            options.detector, options.tracker);
}

std::string programCommit() { return DIORAMA_COMMIT; }

// Everything that decides the results; kept in run.yaml.
std::string recipe(const RunArguments& arguments, const RunInput& input,
                   const std::vector<int>& frames, const RunOptions& options) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  const auto put = [&](const char* key, const std::string& value) {
    out << YAML::Key << key << YAML::Value << value;
  };
  put("version", DIORAMA_VERSION);
  put("commit", DIORAMA_COMMIT);
  put("input", arguments.input);
  put("input_sha256", input.digest);
  put("seed", std::to_string(input.seed));
  put("quality", arguments.quality);
  put("method", arguments.method);
  put("initial", arguments.initial);
  put("odometry", arguments.odometry);
  put("tracker_kind", arguments.tracker);
  put("frames", std::to_string(frames.front()) + ":" + std::to_string(frames.back() + 1));
  put("every", std::to_string(arguments.every));
  put("realtime", arguments.realtime ? "true" : "false");
  put("video", arguments.no_video ? "false" : "true");
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n" + toYaml(options);
}

}  // namespace diorama
