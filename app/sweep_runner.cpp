#include "app/sweep_runner.h"

#include <atomic>
#include <mutex>
#include <nlohmann/json.hpp>

#include "app/child_process.h"
#include "app/command_line.h"
#include "app/command_text.h"
#include "app/metrics_json.h"
#include "app/progress.h"
#include "app/run_options.h"
#include "app/task_queue.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// Cells that see the same pictures.
struct Group {
  std::string key;
  std::vector<size_t> cells;
};

std::string pictureKey(const SweepCell& cell) {
  return sha256(cell.scene + "\n" + shellLine(cell.render)).substr(0, 16);
}

std::vector<Group> groupsOf(const std::vector<SweepCell>& cells) {
  std::vector<Group> groups;
  std::map<std::string, size_t> known;
  for (size_t i = 0; i < cells.size(); ++i) {
    const std::string key = pictureKey(cells[i]);
    const auto [at, is_new] = known.try_emplace(key, groups.size());
    if (is_new) groups.push_back({key, {}});
    groups[at->second].cells.push_back(i);
  }
  return groups;
}

fs::path recordFile(const fs::path& folder, const SweepCell& cell) {
  return folder / "cells" / (cellKey(cell) + ".json");
}

// The groups of a shard, with the cells that have no record.
std::vector<Group> missingGroups(const SweepJob& job, const std::vector<SweepCell>& cells) {
  std::vector<Group> missing;
  const std::vector<Group> groups = groupsOf(cells);
  for (size_t g = 0; g < groups.size(); ++g) {
    if (static_cast<int>(g % static_cast<size_t>(job.shards)) != job.shard) continue;
    Group rest{groups[g].key, {}};
    for (size_t cell : groups[g].cells)
      if (!fs::exists(recordFile(job.folder, cells[cell]))) rest.cells.push_back(cell);
    if (!rest.cells.empty()) missing.push_back(std::move(rest));
  }
  return missing;
}

void removeAll(const fs::path& path) {
  std::error_code ignored;
  fs::remove_all(path, ignored);
}

SweepRecord recordOf(const ChildResult& child) {
  SweepRecord record{"done", child.exit_code, {}, child.wall_s};
  if (child.timed_out)
    record = {"timeout", 0, {}, child.wall_s};
  else if (child.signal)
    record = {"crashed", child.signal, {}, child.wall_s};
  else if (child.exit_code)
    record = {"failed", child.exit_code, {}, child.wall_s};
  return record;
}

class Runner {
 public:
  Runner(const SweepJob& job, const SweepSpec& spec, const std::vector<SweepCell>& cells,
         size_t total)
      : job_(job),
        cells_(cells),
        limits_{spec.time_limit_s, spec.file_limit_mb},
        total_(total),
        progress_("cells", static_cast<int>(total), "cells") {}

  void begin(const Group& group) {
    if (group.cells.size() == 1)
      queue_.add([this, cell = group.cells[0]] { measure(cell, cells_[cell].scene, true); });
    else
      queue_.add([this, group] { film(group); });
  }
  void run() { queue_.run(job_.processes); }

 private:
  // Pictures for all cells of the group, then the cells.
  void film(const Group& group) {
    const fs::path pictures = job_.folder / "pictures" / group.key;
    removeAll(pictures);  // of a process that was stopped
    std::vector<std::string> command = {thisProgram(), "render", cells_[group.cells[0]].scene, "-o",
                                        pictures.string()};
    const auto& options = cells_[group.cells[0]].render;
    command.insert(command.end(), options.begin(), options.end());
    const ChildResult child = runChild(command, log(), limits_);
    if (!child.done()) {
      removeAll(pictures);
      SweepRecord record = recordOf(child);
      record.status = "not filmed: " + record.status;
      for (size_t cell : group.cells) keep(cell, record);
      return;
    }
    const auto left = std::make_shared<std::atomic<size_t>>(group.cells.size());
    for (size_t cell : group.cells)
      queue_.addFirst([this, cell, pictures, left] {
        measure(cell, pictures, false);
        if (--*left == 0) removeAll(pictures);
      });
  }

  void measure(size_t index, const fs::path& input, bool is_scene) {
    const SweepCell& cell = cells_[index];
    const fs::path folder = job_.folder / "runs" / cellKey(cell);
    removeAll(folder);
    std::vector<std::string> command = {thisProgram(),   "run",        input.string(), "-o",
                                        folder.string(), "--no-video", "--no-report"};
    const auto options = is_scene ? cell.options : withoutScene(cell.options);
    command.insert(command.end(), options.begin(), options.end());
    SweepRecord record = recordOf(runChild(command, log(), limits_));
    if (record.status == "done") record.metrics = metricsFromJson(folder / "metrics.json");
    removeAll(folder);
    keep(index, record);
  }

  // What a sequence takes: its pictures are made already.
  static std::vector<std::string> withoutScene(const std::vector<std::string>& options) {
    std::vector<std::string> out;
    for (size_t i = 0; i + 1 < options.size(); i += 2) {
      const std::string &name = options[i], &value = options[i + 1];
      if (name == "--quality" || name == "--frames" || name == "--seed") continue;
      if (name == "--set" && splitOverrides({value}).estimators.empty()) continue;
      out.insert(out.end(), {name, value});
    }
    return out;
  }

  void keep(size_t index, const SweepRecord& record) {
    nlohmann::ordered_json json = {
        {"status", record.status}, {"code", record.code}, {"wall_s", record.wall_s}};
    json["metrics"] = record.metrics ? nlohmann::ordered_json::parse(toJson(*record.metrics))
                                     : nlohmann::ordered_json();
    writeFileAtomically(recordFile(job_.folder, cells_[index]), json.dump(1) + "\n");
    const std::lock_guard lock(mutex_);
    progress_.update(static_cast<int>(++done_), record.status == "done" ? "" : record.status);
  }

  fs::path log() const { return job_.folder / "log.txt"; }

  const SweepJob& job_;
  const std::vector<SweepCell>& cells_;
  ChildLimits limits_;
  size_t total_, done_ = 0;
  Progress progress_;
  std::mutex mutex_;
  TaskQueue queue_;
};

}  // namespace

std::string cellKey(const SweepCell& cell) {
  return sha256(cell.scene + "\n" + shellLine(cell.options)).substr(0, 16);
}

std::map<size_t, SweepRecord> readRecords(const fs::path& folder,
                                          const std::vector<SweepCell>& cells) {
  std::map<size_t, SweepRecord> records;
  for (size_t i = 0; i < cells.size(); ++i) {
    const fs::path file = recordFile(folder, cells[i]);
    if (!fs::exists(file)) continue;
    try {
      const auto json = nlohmann::ordered_json::parse(readFile(file));
      SweepRecord record{json.at("status").get<std::string>(),
                         json.at("code").get<int>(),
                         {},
                         json.at("wall_s").get<double>()};
      if (!json.at("metrics").is_null())
        record.metrics = metricsFromText(json.at("metrics").dump(), file);
      records.emplace(i, std::move(record));
    } catch (const nlohmann::json::exception& error) {
      throw InputError(file, std::string("is no record of a cell: ") + error.what(), "delete it");
    }
  }
  return records;
}

size_t missingCells(const SweepJob& job, const std::vector<SweepCell>& cells) {
  size_t n = 0;
  for (const Group& group : missingGroups(job, cells)) n += group.cells.size();
  return n;
}

void runCells(const SweepJob& job, const SweepSpec& spec, const std::vector<SweepCell>& cells) {
  createFolder(job.folder / "cells");
  createFolder(job.folder / "pictures");
  createFolder(job.folder / "runs");
  Runner runner(job, spec, cells, missingCells(job, cells));
  for (const Group& group : missingGroups(job, cells)) runner.begin(group);
  runner.run();
  std::error_code ignored;  // another shard may be at work in them
  for (const char* name : {"pictures", "runs"}) fs::remove(job.folder / name, ignored);
}

}  // namespace diorama
