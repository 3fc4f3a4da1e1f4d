#include "app/reproduce_tables.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/paper.h"
#include "core/files.h"
#include "core/text.h"
#include "core/trajectory.h"
#include "eval/alignment.h"
#include "eval/csv.h"
#include "eval/object_errors.h"
#include "eval/statistics.h"
#include "eval/trajectory_errors.h"

namespace diorama {
namespace {

const ObjectMetrics& object(const Metrics& metrics) { return metrics.objects.at(0).metrics; }

// Over the frames since the first estimate, as the paper's sequences begin with the object found.
std::optional<double> ratioSinceStart(const Metrics& metrics) {
  const auto ratio = object(metrics).ratio_below_0_5_m;
  if (!ratio || !metrics.start_frame || *metrics.start_frame >= metrics.frames) return ratio;
  return std::min(1.0, *ratio * metrics.frames / (metrics.frames - *metrics.start_frame));
}

ReproducedTable objectTable(const std::vector<ReproducedSequence>& sequences) {
  ReproducedTable out{"Table 1: object, mean error below 0.5 m and share of such frames",
                      "mm and % of the frames since the first estimate; the paper's figures (real "
                      "sequences of its own) in brackets.",
                      {{"sequence"}, {}}};
  for (const char* method : kMethods) out.table.header.push_back(std::string(method) + ", mm");
  for (const char* method : kMethods) out.table.header.push_back(std::string(method) + ", %");
  for (size_t s = 0; s < sequences.size(); ++s) {
    std::vector<std::string> row = {sequences[s].title};
    for (size_t m = 0; m < 3; ++m)
      row.push_back(formatCell(object(sequences[s].metrics[m]).mean_error_m, 2, 1e3) + " (" +
                    formatFixed(1e3 * kPaper[s].error_m[m], 0) + ")");
    for (size_t m = 0; m < 3; ++m)
      row.push_back(formatCell(ratioSinceStart(sequences[s].metrics[m]), 1, 100) + " (" +
                    formatFixed(kPaper[s].ratio_percent[m], 1) + ")");
    out.table.rows.push_back(row);
  }
  return out;
}

// The same objects where every method has an estimate below 0.5 m: a tracker that is silent while
// its object is hidden is not measured against estimates of where it is.
struct CommonErrors {
  std::array<double, 3> mean_m{};
  double share = 0;  // of all frames
};

std::optional<CommonErrors> commonErrors(const ErrorPanel& panel) {
  CommonErrors common;
  for (size_t i = 0; i < panel.times_s.size(); ++i) {
    const auto counts = [&](const ErrorCurve& curve) {
      return curve.error_m[i] && *curve.error_m[i] < kFar_m;
    };
    if (!std::all_of(panel.curves.begin(), panel.curves.end(), counts)) continue;
    common.share += 1;
    for (size_t m = 0; m < 3; ++m) common.mean_m[m] += *panel.curves[m].error_m[i];
  }
  if (common.share == 0) return std::nullopt;
  for (double& mean : common.mean_m) mean /= common.share;
  common.share /= static_cast<double>(panel.times_s.size());
  return common;
}

ReproducedTable commonTable(const std::vector<ReproducedSequence>& sequences) {
  ReproducedTable out{"Table 1 over the frames for which every method answers",
                      "mm, mean error, and % of all frames; the paper has no such table.",
                      {{"sequence", "vo, mm", "ebt, mm", "fused, mm", "frames, %"}, {}}};
  for (const ErrorPanel& panel : errorPanels(sequences)) {
    const auto common = commonErrors(panel);
    std::vector<std::string> row = {panel.title};
    for (size_t m = 0; m < 3; ++m)
      row.push_back(common ? formatFixed(1e3 * common->mean_m[m], 2) : "–");
    row.push_back(formatFixed(common ? 100 * common->share : 0, 1));
    out.table.rows.push_back(row);
  }
  return out;
}

// Position errors after one alignment without scale; as evaluateTrajectory, but each of them.
std::vector<double> positionErrors(const std::filesystem::path& run) {
  const Trajectory estimate = readTum(run / "camera_online.txt"),
                   truth = readTum(run / "truth/camera.txt");
  std::vector<Vector3d> source, target;
  for (const StampedPose& pose : estimate.poses)
    if (const StampedPose* match = truth.nearest(pose.timestamp_ns, kAssociationGap_ns)) {
      source.push_back(pose.pose.translation);
      target.push_back(match->pose.translation);
    }
  const Similarity alignment = umeyama(source, target, Alignment::kSE3);
  std::vector<double> errors;
  for (size_t i = 0; i < source.size(); ++i)
    errors.push_back((alignment.T_target_source * source[i] - target[i]).norm());
  return errors;
}

std::string meanAndStd(const std::optional<double>& mean, const std::optional<double>& std) {
  return formatCell(mean, 2, 1e3) + " ± " + formatCell(std, 2, 1e3);
}

ReproducedTable cameraTable(const std::vector<ReproducedSequence>& sequences) {
  ReproducedTable out{"Table 2: camera, absolute trajectory error",
                      "mm, mean ± standard deviation, and median; the paper's means in brackets.",
                      {{"sequence", "vo, mean", "fused, mean", "vo, median", "fused, median"}, {}}};
  std::array<std::vector<double>, 2> all;
  for (size_t s = 0; s < sequences.size(); ++s) {
    std::vector<std::string> row = {sequences[s].title};
    for (size_t k = 0; k < 2; ++k) {
      const CameraMetrics& camera = sequences[s].metrics[2 * k].camera;
      row.push_back(meanAndStd(camera.ate_mean_m, camera.ate_std_m) + " (" +
                    formatFixed(1e3 * kPaper[s].ate_m[k], 0) + ")");
      const std::vector<double> errors = positionErrors(sequences[s].folders[2 * k]);
      all[k].insert(all[k].end(), errors.begin(), errors.end());
    }
    for (size_t k = 0; k < 2; ++k)
      row.push_back(formatCell(sequences[s].metrics[2 * k].camera.ate_median_m, 2, 1e3));
    out.table.rows.push_back(row);
  }
  std::vector<std::string> last = {"All"};
  std::vector<std::string> medians;
  for (const std::vector<double>& errors : all) {
    const auto summary = summarise(errors);
    last.push_back(summary ? meanAndStd(summary->mean, summary->std) : "–");
    medians.push_back(summary ? formatFixed(1e3 * summary->median, 2) : "–");
  }
  last.insert(last.end(), medians.begin(), medians.end());
  out.table.rows.push_back(last);
  return out;
}

ReproducedTable strictTable(const std::vector<ReproducedSequence>& sequences) {
  ReproducedTable out{
      "Stricter: the object within 5 cm and 5°, within 1 cm and 1°, ADD AUC up to 10 cm",
      "% of all frames; the paper has no such columns.",
      {{"sequence"}, {}}};
  const auto add = [&](const char* name, auto member) {
    for (const char* method : kMethods)
      out.table.header.push_back(std::string(method) + ", " + name);
    for (size_t s = 0; s < sequences.size(); ++s) {
      if (out.table.rows.size() <= s) out.table.rows.push_back({sequences[s].title});
      for (size_t m = 0; m < 3; ++m)
        out.table.rows[s].push_back(formatCell(object(sequences[s].metrics[m]).*member, 1, 100));
    }
  };
  add("5/5", &ObjectMetrics::success_5cm_5deg);
  add("1/1", &ObjectMetrics::success_1cm_1deg);
  add("ADD", &ObjectMetrics::add_auc_10cm);
  return out;
}

}  // namespace

std::vector<ReproducedTable> reproducedTables(const std::vector<ReproducedSequence>& sequences) {
  return {objectTable(sequences), commonTable(sequences), cameraTable(sequences),
          strictTable(sequences)};
}

std::string headline(const std::vector<ReproducedSequence>& sequences) {
  std::array<double, 3> ours{}, paper{}, together{};
  for (const ErrorPanel& panel : errorPanels(sequences))
    if (const auto common = commonErrors(panel))
      for (size_t m = 0; m < 3; ++m)
        together[m] += common->mean_m[m] / static_cast<double>(sequences.size());
    else
      return panel.title + ": there is no frame for which every method answers.";
  for (size_t s = 0; s < sequences.size(); ++s)
    for (size_t m = 0; m < 3; ++m) {
      const auto error = object(sequences[s].metrics[m]).mean_error_m;
      if (!error) return sequences[s].title + ": " + kMethods[m] + " has no estimate below 0.5 m.";
      ours[m] += *error / static_cast<double>(sequences.size());
      paper[m] += kPaper[s].error_m[m] / static_cast<double>(sequences.size());
    }
  const auto gain = [](const std::array<double, 3>& error) {
    const double less = 100 * (1 - error[2] / error[1]);
    return formatFixed(std::abs(less), 1) + (less < 0 ? "% more than " : "% less than ");
  };
  return "Fused, the objects' mean error is " + formatFixed(1e3 * ours[2], 2) + " mm, " +
         gain(ours) + "the tracker's alone (" + formatFixed(1e3 * ours[1], 2) +
         " mm); in the paper " + formatFixed(1e3 * paper[2], 0) + " mm, " + gain(paper) +
         formatFixed(1e3 * paper[1], 0) +
         " mm. Over the frames for which every method answers it is " +
         formatFixed(1e3 * together[2], 2) + " mm, " + gain(together) +
         formatFixed(1e3 * together[1], 2) + " mm.";
}

std::vector<ErrorPanel> errorPanels(const std::vector<ReproducedSequence>& sequences) {
  std::vector<ErrorPanel> panels;
  for (const ReproducedSequence& sequence : sequences) {
    ErrorPanel panel{sequence.title, {}, {}, {}};
    for (size_t m = 0; m < 3; ++m) {
      const CsvTable table = parseCsv(readFile(sequence.folders[m] / "errors.csv"));
      const size_t time = table.column("timestamp").value(), error = table.column("err_m").value(),
                   visible = table.column("visible_fraction").value();
      ErrorCurve curve{kMethods[m], {}};
      for (const auto& row : table.rows) {
        curve.error_m.push_back(parseNumber(row[error]));
        if (m > 0) continue;
        panel.times_s.push_back(parseNumber(row[time]).value_or(0));
        panel.visible_fraction.push_back(parseNumber(row[visible]));
      }
      curve.error_m.resize(panel.times_s.size());
      panel.curves.push_back(std::move(curve));
    }
    panels.push_back(std::move(panel));
  }
  return panels;
}

std::string toMarkdown(const std::vector<ReproducedTable>& tables) {
  std::string text;
  const auto line = [&](const std::vector<std::string>& cells, size_t width) {
    text += "|";
    for (size_t i = 0; i < width; ++i) text += " " + (i < cells.size() ? cells[i] : "") + " |";
    text += "\n";
  };
  for (const ReproducedTable& table : tables) {
    text += (text.empty() ? "**" : "\n**") + table.title + "** — " + table.note + "\n\n";
    const size_t width = table.table.header.size();
    line(table.table.header, width);
    text += "|---|";
    for (size_t i = 1; i < width; ++i) text += "--:|";
    text += "\n";
    for (const auto& row : table.table.rows) line(row, width);
  }
  return text;
}

}  // namespace diorama
