#include "eval/table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/text.h"

namespace diorama {
namespace {

// Characters of UTF-8: bytes that do not continue one.
size_t width(const std::string& text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

std::string repeated(const std::string& text, size_t times) {
  std::string out;
  for (size_t i = 0; i < times; ++i) out += text;
  return out;
}

void trimRight(std::string& line) { line.erase(line.find_last_not_of(' ') + 1); }

std::string cellOf(const std::vector<std::string>& row, size_t column) {
  return column < row.size() ? row[column] : "";
}

std::string formatRow(const std::vector<std::string>& row, const std::vector<size_t>& widths) {
  std::string line;
  for (size_t i = 0; i < widths.size(); ++i) {
    const std::string cell = cellOf(row, i);
    const std::string blanks(widths[i] - width(cell), ' ');
    line += (i ? "  " : "") + (i ? blanks + cell : cell + blanks);
  }
  trimRight(line);
  return line + "\n";
}

constexpr double kMillimetres = 1e3;
constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kPercent = 100;

std::string formatCamera(const CameraMetrics& m) {
  Table table{
      {"camera", "ATE mean mm", "std", "median", "rmse", "RPE mm", "RPE °", "scale", "tracked %"},
      {}};
  table.rows.push_back(
      {"", formatCell(m.ate_mean_m, 2, kMillimetres), formatCell(m.ate_std_m, 2, kMillimetres),
       formatCell(m.ate_median_m, 2, kMillimetres), formatCell(m.ate_rmse_m, 2, kMillimetres),
       formatCell(m.rpe_trans_rmse_m, 3, kMillimetres), formatCell(m.rpe_rot_rmse_rad, 3, kDegrees),
       formatCell(m.sim3_scale, 4), formatCell(m.tracked_ratio, 1, kPercent)});
  return formatTable(table);
}

std::string formatObjects(const std::vector<NamedObjectMetrics>& objects) {
  Table table{{"object", "error mm", "median mm", "error °", "5cm5° %", "1cm1° %", "ADD AUC %",
               "claimed %", "false %", "map mm", "map °"},
              {}};
  for (const auto& [name, m] : objects)
    table.rows.push_back(
        {name, formatCell(m.mean_error_m, 2, kMillimetres),
         formatCell(m.median_error_m, 2, kMillimetres), formatCell(m.mean_error_rad, 2, kDegrees),
         formatCell(m.success_5cm_5deg, 1, kPercent), formatCell(m.success_1cm_1deg, 1, kPercent),
         formatCell(m.add_auc_10cm, 1, kPercent), formatCell(m.claimed_ratio, 1, kPercent),
         formatCell(m.false_claim_ratio, 1, kPercent), formatCell(m.map_error_m, 2, kMillimetres),
         formatCell(m.map_error_rad, 2, kDegrees)});
  return formatTable(table);
}

std::string formatTiming(const Metrics& metrics) {
  const TimingMetrics& m = metrics.timing;
  Table table{{"time", "wall s", "frames/s", "render ms", "odometry ms", "tracker ms", "mapper ms",
               "memory MB"},
              {}};
  table.rows.push_back({std::to_string(metrics.frames) + " frames", formatCell(m.wall_s, 1),
                        formatCell(m.frames_per_s, 1), formatCell(m.render_ms, 2),
                        formatCell(m.vo_ms, 2), formatCell(m.tracker_ms, 2),
                        formatCell(m.mapper_ms, 2), formatCell(metrics.peak_memory_mb, 0)});
  return formatTable(table);
}

}  // namespace

std::string formatTable(const Table& table) {
  size_t columns = table.header.size();
  for (const auto& row : table.rows) columns = std::max(columns, row.size());
  std::vector<size_t> widths(columns, 0);
  for (size_t i = 0; i < columns; ++i) {
    widths[i] = width(cellOf(table.header, i));
    for (const auto& row : table.rows) widths[i] = std::max(widths[i], width(cellOf(row, i)));
  }
  size_t total = columns ? 2 * (columns - 1) : 0;
  for (size_t w : widths) total += w;
  std::string text = formatRow(table.header, widths) + repeated("─", total) + "\n";
  for (const auto& row : table.rows) text += formatRow(row, widths);
  return text;
}

std::string formatCell(const std::optional<double>& value, int decimals, double factor) {
  if (!value || !std::isfinite(*value)) return "–";
  return formatFixed(factor * *value, decimals);
}

std::string formatMetrics(const Metrics& metrics) {
  return formatCamera(metrics.camera) + "\n" + formatObjects(metrics.objects) + "\n" +
         formatTiming(metrics);
}

}  // namespace diorama
