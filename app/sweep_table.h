// The tables of a sweep, and its thresholds.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/sweep_runner.h"
#include "eval/csv.h"

namespace diorama {

// Every metric of a cell by its column: camera.*, and object.*, the mean over the tracked objects
// that have a value (with one object, its value). Nothing that depends on the machine.
std::vector<MetricValue> cellMetrics(const Metrics& metrics);

// One row per recorded cell, in the order of the cells: results without paths and times (the same
// bytes for the same results), timings apart.
CsvTable resultsTable(const SweepSpec& spec, const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records);
CsvTable timingsTable(const SweepSpec& spec, const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records);
std::string toCsv(const CsvTable& table);

// The command that repeats a cell.
std::string cellCommand(const SweepCell& cell);

// A threshold over the cells that it is for: each point of the grid by its mean over the seeds.
struct ThresholdResult {
  bool met = false;
  std::string detail;  // the worst point, or why there is none
};
ThresholdResult judge(const SweepThreshold& threshold, const SweepSpec& spec,
                      const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records);

}  // namespace diorama
