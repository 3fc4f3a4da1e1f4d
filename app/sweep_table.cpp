#include "app/sweep_table.h"

#include <algorithm>

#include "app/command_text.h"
#include "core/text.h"

namespace diorama {
namespace {

const ObjectMetrics kNoObject;  // for the names
const TimingMetrics kNoTiming;

std::string field(const std::optional<double>& value) { return value ? formatNumber(*value) : ""; }

std::vector<std::string> leadHeader(const SweepSpec& spec) {
  std::vector<std::string> header = {"cell"};
  for (const SweepFactor& factor : spec.factors) header.push_back(factor.name);
  header.insert(header.end(), {"seed", "status", "code"});
  return header;
}

std::vector<std::string> leadFields(const SweepSpec& spec, const SweepCell& cell, size_t number,
                                    const SweepRecord& record) {
  std::vector<std::string> row = {std::to_string(number)};
  for (size_t f = 0; f < spec.factors.size(); ++f)
    row.push_back(spec.factors[f].cases[cell.at[f]].label);
  row.insert(row.end(), {std::to_string(cell.seed), record.status, std::to_string(record.code)});
  return row;
}

std::string pointText(const SweepSpec& spec, const std::vector<size_t>& at) {
  std::string text;
  for (size_t f = 0; f < at.size(); ++f)
    text += (f ? ", " : "") + spec.factors[f].name + " " + spec.factors[f].cases[at[f]].label;
  return text;
}

std::optional<double> valueOf(const SweepRecord& record, const std::string& metric) {
  if (!record.metrics) return std::nullopt;
  for (const MetricValue& value : cellMetrics(*record.metrics))
    if (value.path == metric || value.path == "object." + metric ||
        value.path == "camera." + metric)
      return value.value;
  return std::nullopt;
}

}  // namespace

std::vector<MetricValue> cellMetrics(const Metrics& metrics) {
  std::vector<MetricValue> values = {{"frames", double(metrics.frames)}, {"start_frame", {}}};
  if (metrics.start_frame) values[1].value = *metrics.start_frame;
  CameraMetrics::visit(metrics.camera, [&](const char* name, const auto& value) {
    values.push_back({std::string("camera.") + name, value});
  });
  const size_t first = values.size();
  ObjectMetrics::visit(kNoObject, [&](const char* name, const auto&) {
    values.push_back({std::string("object.") + name, {}});
  });
  std::vector<int> counts(values.size(), 0);
  for (const NamedObjectMetrics& object : metrics.objects) {
    size_t i = first;
    ObjectMetrics::visit(object.metrics, [&](const char*, const auto& value) {
      if (value) {
        values[i].value = values[i].value.value_or(0) + static_cast<double>(*value);
        ++counts[i];
      }
      ++i;
    });
  }
  for (size_t i = first; i < values.size(); ++i)
    if (counts[i] > 1) *values[i].value /= counts[i];
  return values;
}

std::string cellCommand(const SweepCell& cell) {
  std::vector<std::string> words = {"diorama", "run", cell.scene, "-o", "RUN"};
  words.insert(words.end(), cell.options.begin(), cell.options.end());
  return shellLine(words);
}

CsvTable resultsTable(const SweepSpec& spec, const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records) {
  CsvTable table{leadHeader(spec), {}};
  for (const MetricValue& value : cellMetrics(Metrics{})) table.header.push_back(value.path);
  table.header.emplace_back("command");
  for (const auto& [i, record] : records) {
    std::vector<std::string> row = leadFields(spec, cells[i], i, record);
    if (record.metrics)
      for (const MetricValue& value : cellMetrics(*record.metrics))
        row.push_back(field(value.value));
    row.resize(table.header.size() - 1);
    row.push_back(cellCommand(cells[i]));
    table.rows.push_back(std::move(row));
  }
  return table;
}

CsvTable timingsTable(const SweepSpec& spec, const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records) {
  CsvTable table{leadHeader(spec), {}};
  table.header.emplace_back("process_s");
  TimingMetrics::visit(kNoTiming,
                       [&](const char* name, const auto&) { table.header.emplace_back(name); });
  table.header.emplace_back("peak_memory_mb");
  for (const auto& [i, record] : records) {
    std::vector<std::string> row = leadFields(spec, cells[i], i, record);
    row.push_back(formatFixed(record.wall_s, 3));
    if (record.metrics) {
      TimingMetrics::visit(record.metrics->timing, [&](const char*, const auto& value) {
        row.push_back(value ? formatNumber(static_cast<double>(*value)) : "");
      });
      row.push_back(field(record.metrics->peak_memory_mb));
    }
    row.resize(table.header.size());
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string toCsv(const CsvTable& table) {
  std::string text = csvLine(table.header);
  for (const auto& row : table.rows) text += csvLine(row);
  return text;
}

ThresholdResult judge(const SweepThreshold& threshold, const SweepSpec& spec,
                      const std::vector<SweepCell>& cells,
                      const std::map<size_t, SweepRecord>& records) {
  struct Point {
    double sum = 0;
    int known = 0, unknown = 0;
  };
  std::map<std::vector<size_t>, Point> points;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (!applies(threshold, spec, cells[i].at)) continue;
    Point& point = points[cells[i].at];
    const auto record = records.find(i);
    const auto value =
        record == records.end() ? std::nullopt : valueOf(record->second, threshold.metric);
    value ? ++point.known : ++point.unknown;
    point.sum += value.value_or(0);
  }
  if (points.empty()) return {false, "no cell is meant by it"};
  ThresholdResult result{true, ""};
  double worst_margin = 0;
  int missed = 0;
  for (const auto& [at, point] : points) {
    if (point.unknown)
      return {false, "not known at " + pointText(spec, at) + " (" + std::to_string(point.unknown) +
                         " cells)"};
    const double mean = point.sum / point.known;
    double margin = 1e300;
    if (threshold.at_least) margin = std::min(margin, mean - *threshold.at_least);
    if (threshold.at_most) margin = std::min(margin, *threshold.at_most - mean);
    missed += margin < 0;
    if (!result.detail.empty() && margin >= worst_margin) continue;
    worst_margin = margin;
    result.detail = "worst: " + formatNumber(mean) + " at " + pointText(spec, at);
  }
  result.met = missed == 0;
  if (missed)
    result.detail += "; missed at " + std::to_string(missed) + " of " +
                     std::to_string(points.size()) + " points";
  return result;
}

}  // namespace diorama
