#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/command_line.h"
#include "app/run_setup.h"
#include "app/sqlite_file.h"
#include "app/sweep_report.h"
#include "app/sweep_table.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

struct SweepArguments {
  std::string spec, output, shard;
  std::vector<std::string> merge;
  int processes = 1;
  bool resume = false;
};

void parseShard(const std::string& text, SweepJob& job) {
  if (text.empty()) return;
  const std::vector<std::string_view> parts = split(text, '/');
  const auto index = parts.size() == 2 ? parseInteger(parts[0]) : std::nullopt;
  const auto count = parts.size() == 2 ? parseInteger(parts[1]) : std::nullopt;
  if (!index || !count || *count < 1 || *count > 100000 || *index < 0 || *index >= *count)
    throw UsageError("--shard " + text + ": expected I/N with 0 <= I < N");
  job.shard = static_cast<int>(*index);
  job.shards = static_cast<int>(*count);
}

// Locks the folder for as long as it lives: shards may share one.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : descriptor_(::open((folder / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644)) {
    if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX);
  }
  ~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

// The folder is this sweep's: made for it now, or before by the same program.
void claimFolder(const SweepArguments& arguments, const SweepSpec& spec, const SweepJob& job,
                 const std::vector<SweepCell>& cells) {
  const std::string recipe =
      std::string("# version ") + DIORAMA_VERSION + ", " + programCommit() + "\n" + spec.text;
  const fs::path file = job.folder / "sweep.yaml";
  std::error_code error;
  if (fs::exists(file)) {
    if (readFile(file) != recipe)
      throw OutputError(job.folder,
                        "was made by another program or for another sweep; choose another -o");
    const bool goes_on = arguments.resume || job.shards > 1 || !arguments.merge.empty();
    if (!goes_on && missingCells(job, cells) > 0)
      throw OutputError(job.folder, "is incomplete; go on with --resume, or delete it");
    return;
  }
  if (fs::exists(job.folder, error) && !fs::is_empty(job.folder, error))
    throw OutputError(job.folder, "exists and holds something else; choose another -o");
  createFolder(job.folder);
  writeFileAtomically(file, recipe);
}

void mergeFrom(const std::vector<std::string>& folders, const SweepJob& job,
               const std::vector<SweepCell>& cells) {
  createFolder(job.folder / "cells");
  for (const fs::path folder : folders) {
    if (!fs::exists(folder / "sweep.yaml"))
      throw MissingInputError(folder / "sweep.yaml", "expected the folder of a sweep");
    if (readFile(folder / "sweep.yaml") != readFile(job.folder / "sweep.yaml"))
      throw InputError(folder / "sweep.yaml", "is of another sweep or program");
    for (const SweepCell& cell : cells) {
      const std::string name = "cells/" + cellKey(cell) + ".json";
      if (fs::exists(folder / name))
        writeFileAtomically(job.folder / name, readFile(folder / name));
    }
  }
}

nlohmann::ordered_json describe(const SweepSpec& spec, size_t cells) {
  nlohmann::ordered_json json = {{"name", spec.name}, {"version", DIORAMA_VERSION}};
  json["factors"] = nlohmann::ordered_json::array();
  for (const SweepFactor& factor : spec.factors) {
    nlohmann::ordered_json labels = nlohmann::ordered_json::array();
    for (const SweepFactor::Case& one : factor.cases) labels.push_back(one.label);
    json["factors"].push_back({{"name", factor.name}, {"values", labels}});
  }
  json["seeds"] = spec.seeds;
  json["cells"] = cells;
  json["text"] = spec.text;
  return json;
}

// Writes the tables and the report, prints the verdict.
int conclude(const SweepSpec& spec, const SweepJob& job, const std::vector<SweepCell>& cells) {
  const FolderLock lock(job.folder);
  const auto records = readRecords(job.folder, cells);
  const CsvTable results = resultsTable(spec, cells, records),
                 timings = timingsTable(spec, cells, records);
  nlohmann::ordered_json json = describe(spec, cells.size());
  json["thresholds"] = nlohmann::ordered_json::array();
  const bool whole = records.size() == cells.size();
  bool met = true;
  for (const SweepThreshold& threshold : spec.thresholds) {
    if (!whole) continue;
    const ThresholdResult result = judge(threshold, spec, cells, records);
    met = met && result.met;
    json["thresholds"].push_back(
        {{"text", threshold.text}, {"met", result.met}, {"detail", result.detail}});
    std::printf("%s: %s (%s)\n", result.met ? "met" : "missed", threshold.text.c_str(),
                result.detail.c_str());
  }
  writeFileAtomically(job.folder / "timings.csv", toCsv(timings));
  writeSqlite(job.folder / "sweep.sqlite", {{"results", &results}, {"timings", &timings}});
  writeFileAtomically(job.folder / "sweep.json", json.dump(2) + "\n");
  writeFileAtomically(job.folder / "results.csv", toCsv(results));
  writeSweepReport(job.folder, job.folder / "report.html");
  size_t done = 0;
  for (const auto& [i, record] : records) done += record.status == "done";
  std::printf("%zu of %zu cells recorded, %zu of them done\nreport: %s\n", records.size(),
              cells.size(), done, (job.folder / "report.html").c_str());
  return met ? kExitDone : kExitMissed;
}

int sweep(const SweepArguments& arguments) {
  const SweepSpec spec = readSweepSpec(arguments.spec);
  const std::vector<SweepCell> cells = sweepCells(spec);
  SweepJob job{arguments.output, arguments.processes};
  parseShard(arguments.shard, job);
  if (job.processes < 1) throw UsageError("-j must be at least 1");
  claimFolder(arguments, spec, job, cells);
  if (!arguments.merge.empty())
    mergeFrom(arguments.merge, job, cells);
  else if (missingCells(job, cells) > 0)
    runCells(job, spec, cells);
  return conclude(spec, job, cells);
}

}  // namespace

std::function<int()> setUpSweep(CLI::App& app) {
  auto arguments = std::make_shared<SweepArguments>();
  app.add_option("SPEC", arguments->spec, "what to vary (YAML)")->required();
  app.add_option("-o,--output", arguments->output, "folder to write")->required();
  app.add_option("-j,--jobs", arguments->processes, "processes at a time")->capture_default_str();
  app.add_option("--shard", arguments->shard, "I/N: only every N-th group of cells, from the I-th");
  app.add_option("--merge", arguments->merge, "folder of a shard whose cells are taken over")
      ->allow_extra_args(false);
  app.add_flag("--resume", arguments->resume, "run what is missing");
  return [arguments] { return sweep(*arguments); };
}

}  // namespace diorama
