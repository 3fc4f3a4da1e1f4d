#include "app/sweep_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "eval/csv.h"
#include "eval/intervals.h"
#include "eval/report_page.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

const std::set<std::string> kShares = {"camera.tracked_ratio",
                                       "object.ratio_below_0_5_m",
                                       "object.success_5cm_5deg",
                                       "object.success_1cm_1deg",
                                       "object.success_visible_5cm_5deg",
                                       "object.success_visible_1cm_1deg",
                                       "object.reported_ratio",
                                       "object.claimed_ratio",
                                       "object.false_claim_ratio"};

Json intervalJson(const Interval& interval) {
  return Json::array({interval.mean, interval.low, interval.high});
}

// Mean and interval of one metric over the rows of a point.
Json summary(const std::string& metric, const std::vector<const std::vector<std::string>*>& rows,
             size_t column, size_t frames_column) {
  std::vector<double> values;
  double successes = 0, trials = 0;
  for (const auto* row : rows) {
    const auto value = parseNumber((*row)[column]);
    if (!value) continue;
    values.push_back(*value);
    const double frames = parseNumber((*row)[frames_column]).value_or(0);
    successes += *value * frames;
    trials += frames;
  }
  if (values.empty()) return nullptr;
  if (kShares.contains(metric) && trials > 0)
    return intervalJson(wilsonInterval(std::clamp(successes / trials, 0.0, 1.0), trials));
  return intervalJson(*bootstrapInterval(values));
}

size_t required(const CsvTable& table, const std::string& name, const fs::path& file) {
  const auto column = table.column(name);
  if (!column) throw InputError(file, "has no column `" + name + "`");
  return *column;
}

Json cellJson(const CsvTable& table, const std::vector<std::string>& row, const fs::path& file) {
  Json json;
  for (const char* name : {"cell", "seed", "status", "code", "command"})
    json[name] = row[required(table, name, file)];
  return json;
}

Json pointsJson(const CsvTable& table, const Json& factors, const fs::path& file) {
  std::map<std::vector<size_t>, std::vector<const std::vector<std::string>*>> points;
  for (const auto& row : table.rows) {
    std::vector<size_t> at;
    for (const Json& factor : factors) {
      const auto& labels = factor.at("values");
      const std::string& label = row[required(table, factor.at("name").get<std::string>(), file)];
      const auto found = std::find(labels.begin(), labels.end(), label);
      if (found == labels.end()) throw InputError(file, "`" + label + "` is no value of the sweep");
      at.push_back(static_cast<size_t>(found - labels.begin()));
    }
    points[at].push_back(&row);
  }
  const size_t frames = required(table, "frames", file);
  Json list = Json::array();
  for (const auto& [at, rows] : points) {
    Json values = Json::object(), cells = Json::array();
    for (size_t c = 0; c < table.header.size(); ++c) {
      const std::string& metric = table.header[c];
      if (!metric.starts_with("camera.") && !metric.starts_with("object.")) continue;
      values[metric] = summary(metric, rows, c, frames);
    }
    for (const auto* row : rows) cells.push_back(cellJson(table, *row, file));
    list.push_back({{"at", at}, {"values", values}, {"cells", cells}});
  }
  return list;
}

}  // namespace

bool isSweepFolder(const fs::path& folder) { return fs::exists(folder / "sweep.json"); }

void writeSweepReport(const fs::path& folder, const fs::path& output) {
  const fs::path file = folder / "results.csv";
  const CsvTable table = parseCsv(readFile(file));
  try {
    Json data = Json::parse(readFile(folder / "sweep.json"));
    data["kind"] = "sweep";
    data["shares"] = kShares;
    data["points"] = pointsJson(table, data.at("factors"), file);
    data["recorded"] = table.rows.size();
    ReportContent content{data.at("name").get<std::string>() + ", sweep",
                          data.dump(-1, ' ', false, Json::error_handler_t::replace),
                          {}};
    writeFileAtomically(output, reportPage(content));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(folder / "sweep.json", std::string("is none of a sweep: ") + error.what());
  }
}

}  // namespace diorama
