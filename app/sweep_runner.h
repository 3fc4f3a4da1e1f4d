// Runs the cells of a sweep as child processes and keeps a record of each.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "app/sweep_spec.h"
#include "eval/metrics.h"

namespace diorama {

// What became of one cell.
struct SweepRecord {
  std::string status;  // done, failed (exit code), crashed (signal), timeout, not filmed
  int code = 0;        // exit code or signal
  std::optional<Metrics> metrics;
  double wall_s = 0;
};

struct SweepJob {
  std::filesystem::path folder;
  int processes = 1;
  int shard = 0, shards = 1;  // cells whose pictures' group is shard modulo shards
};

// Names the cell by everything that decides its result.
std::string cellKey(const SweepCell& cell);

// DIR/cells/KEY.json of each cell that has one, by the cell's position.
std::map<size_t, SweepRecord> readRecords(const std::filesystem::path& folder,
                                          const std::vector<SweepCell>& cells);

// How many cells of the shard have no record.
size_t missingCells(const SweepJob& job, const std::vector<SweepCell>& cells);

// Runs these. Pictures that several cells see are filmed once, in DIR/pictures, and deleted after
// the last of them.
void runCells(const SweepJob& job, const SweepSpec& spec, const std::vector<SweepCell>& cells);

}  // namespace diorama
