#include "app/run_folder.h"

#include <map>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "eval/csv.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

std::string readIfThere(const fs::path& file) { return fs::exists(file) ? readFile(file) : ""; }

Json readJson(const fs::path& file) {
  try {
    return Json::parse(readFile(file));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file, std::string("is no JSON: ") + error.what());
  }
}

std::optional<double> numberIn(const std::vector<std::string>& row, std::optional<size_t> column) {
  if (!column) return std::nullopt;
  const std::optional<double> value = parseNumber(row[*column]);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string textIn(const std::vector<std::string>& row, std::optional<size_t> column) {
  return column ? row[*column] : "";
}

using FrameIndex = std::map<int, size_t>;

// The frames, from the first of the tables that has any.
FrameIndex readFrames(const std::vector<const CsvTable*>& tables, RunFolder& run) {
  std::map<int, int64_t> times;
  for (const CsvTable* table : tables) {
    const auto frame = table->column("frame"), time = table->column("timestamp");
    if (!frame || !time) continue;
    for (const auto& row : table->rows) {
      const auto number = parseInteger(row[*frame]);
      const auto time_ns = parseSeconds(row[*time]);
      if (number && time_ns) times.emplace(static_cast<int>(*number), *time_ns);
    }
  }
  FrameIndex index;
  for (const auto& [frame, time_ns] : times) {
    index[frame] = run.frames.size();
    run.frames.push_back(frame);
    run.times_ns.push_back(time_ns);
  }
  return index;
}

// f(position of the frame, row) for each row.
template <class F>
void eachRow(const CsvTable& table, const FrameIndex& index, const F& f) {
  const auto frame = table.column("frame");
  if (!frame) return;
  for (const auto& row : table.rows) {
    const auto number = parseInteger(row[*frame]);
    const auto at = number ? index.find(static_cast<int>(*number)) : index.end();
    if (at != index.end()) f(at->second, row);
  }
}

PerFrame<SE3> posesIn(const fs::path& file, const std::vector<int64_t>& times_ns) {
  PerFrame<SE3> poses(times_ns.size());
  if (!fs::exists(file)) return poses;
  const Trajectory trajectory = readTum(file);
  for (size_t i = 0; i < times_ns.size(); ++i)
    if (const StampedPose* pose = trajectory.nearest(times_ns[i], 2000)) poses[i] = pose->pose;
  return poses;
}

std::optional<Matrix6d> covarianceIn(const std::vector<std::string>& row, size_t first) {
  Matrix6d covariance;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) {
      const std::optional<double> value = numberIn(row, first++);
      if (!value) return std::nullopt;
      covariance(i, j) = covariance(j, i) = *value;
    }
  return covariance;
}

RunFolderObject makeObject(const std::string& name, const RunFolder& run) {
  RunFolderObject object;
  object.name = name;
  object.T_camera_object = posesIn(run.path / "objects" / (name + ".txt"), run.times_ns);
  object.T_camera_object_true = posesIn(run.path / "truth/objects" / (name + ".txt"), run.times_ns);
  for (PerFrame<double>* list :
       {&object.error_m, &object.error_rad, &object.visible, &object.health})
    list->resize(run.frames.size());
  object.held.resize(run.frames.size());
  object.covariance.resize(run.frames.size());
  return object;
}

RunFolderObject* find(RunFolder& run, const std::string& name) {
  for (RunFolderObject& object : run.objects)
    if (object.name == name) return &object;
  return nullptr;
}

void readErrors(const CsvTable& table, const FrameIndex& index, RunFolder& run) {
  const auto name = table.column("object"), m = table.column("err_m"),
             rad = table.column("err_rad"), visible = table.column("visible_fraction");
  eachRow(table, index, [&](size_t i, const auto& row) {
    RunFolderObject* object = find(run, textIn(row, name));
    if (!object) return;
    object->error_m[i] = numberIn(row, m);
    object->error_rad[i] = numberIn(row, rad);
    object->visible[i] = numberIn(row, visible);
  });
}

void readMeasured(const CsvTable& table, const FrameIndex& index, RunFolder& run) {
  const auto source = table.column("source"), health = table.column("health"),
             claimed = table.column("claimed"), covariance = table.column("c00");
  eachRow(table, index, [&](size_t i, const auto& row) {
    if (textIn(row, source) == "odometry") run.odometry_health[i] = numberIn(row, health);
    RunFolderObject* object = find(run, textIn(row, source));
    if (!object) return;
    object->health[i] = numberIn(row, health);
    object->held[i] = textIn(row, claimed) == "1";
    if (covariance && *covariance + 21 <= row.size())
      object->covariance[i] = covarianceIn(row, *covariance);
  });
}

void readTiming(const CsvTable& table, const FrameIndex& index, RunFolder& run) {
  const auto odometry = table.column("odometry_ms"), tracker = table.column("tracker_ms"),
             mapper = table.column("mapper_ms");
  for (PerFrame<double>* list :
       {&run.odometry_health, &run.odometry_ms, &run.tracker_ms, &run.mapper_ms})
    list->resize(run.frames.size());
  eachRow(table, index, [&](size_t i, const auto& row) {
    run.odometry_ms[i] = numberIn(row, odometry);
    run.tracker_ms[i] = numberIn(row, tracker);
    run.mapper_ms[i] = numberIn(row, mapper);
  });
}

std::vector<RunFolderEvent> readEvents(const fs::path& file) {
  const CsvTable table = parseCsv(readIfThere(file));
  std::vector<RunFolderEvent> events;
  for (const auto& row : table.rows) {
    const auto time_ns = parseSeconds(textIn(row, table.column("timestamp")));
    if (!time_ns) continue;
    events.push_back(
        {*time_ns, textIn(row, table.column("source")), textIn(row, table.column("event")),
         textIn(row, table.column("reason")), numberIn(row, table.column("value")).value_or(0),
         parseSeconds(textIn(row, table.column("until"))).value_or(*time_ns),
         static_cast<int>(parseInteger(textIn(row, table.column("frames"))).value_or(1))});
  }
  return events;
}

void readMap(const fs::path& file, RunFolder& run) {
  if (!fs::exists(file)) return;
  const Json map = readJson(file);
  if (!map.contains("objects") || !map["objects"].is_object()) return;
  for (RunFolderObject& object : run.objects) {
    if (!map["objects"].contains(object.name)) continue;
    const Json& entry = map["objects"][object.name];
    const auto pose = entry.value("T_world_object", std::vector<double>());
    const auto covariance = entry.value("covariance", std::vector<double>());
    if (pose.size() == 16)
      object.T_world_object = SE3::fromMatrix(
          Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(pose.data()));
    if (covariance.size() == 36)
      object.map_covariance =
          Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(covariance.data());
  }
}

std::vector<double> readPoints(const fs::path& file) {
  const CsvTable table = parseCsv(readIfThere(file));
  std::vector<double> points;
  for (const auto& row : table.rows)
    for (const char* axis : {"x", "y", "z"})
      points.push_back(numberIn(row, table.column(axis)).value_or(0));
  return points;
}

}  // namespace

RunFolder readRunFolder(const fs::path& folder) {
  RunFolder run;
  run.path = folder;
  if (!fs::exists(folder / "metrics.json"))
    throw MissingInputError(folder / "metrics.json", "expected the folder of a complete run");
  run.metrics = readJson(folder / "metrics.json");
  if (!run.metrics.is_object() || !run.metrics.contains("objects") ||
      !run.metrics["objects"].is_object())
    throw InputError(folder / "metrics.json", "is no metrics.json of a run");
  run.models = fs::exists(folder / "models.json") ? readJson(folder / "models.json") : Json();
  run.command = std::string(trim(readIfThere(folder / "command.txt")));
  run.recipe = readIfThere(folder / "run.yaml");
  run.verdict = fs::exists(folder / "verdict.json") ? readJson(folder / "verdict.json") : Json();
  const CsvTable frames = parseCsv(readIfThere(folder / "frames.csv")),
                 timing = parseCsv(readIfThere(folder / "timing.csv")),
                 errors = parseCsv(readIfThere(folder / "errors.csv"));
  const FrameIndex index = readFrames({&timing, &frames}, run);
  run.T_world_camera = posesIn(folder / "camera_online.txt", run.times_ns);
  run.T_world_camera_true = posesIn(folder / "truth/camera.txt", run.times_ns);
  for (const auto& [name, metrics] : run.metrics["objects"].items())
    run.objects.push_back(makeObject(name, run));
  readTiming(timing, index, run);
  readErrors(errors, index, run);
  readMeasured(frames, index, run);
  readMap(folder / "map.json", run);
  run.events = readEvents(folder / "events.csv");
  run.points = readPoints(folder / "points.csv");
  return run;
}

}  // namespace diorama
