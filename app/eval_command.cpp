#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/command_line.h"
#include "core/errors.h"
#include "core/text.h"
#include "core/trajectory.h"
#include "eval/table.h"
#include "eval/trajectory_errors.h"

namespace diorama {
namespace {

struct EvalArguments {
  std::string estimate, truth, align = "se3";
  bool json = false;
};

struct NamedStatistics {
  const char* name;
  const std::optional<Statistics>& values;
};

std::vector<NamedStatistics> named(const TrajectoryErrors& errors) {
  return {{"ape_trans_m", errors.ape_trans_m},
          {"ape_rot_rad", errors.ape_rot_rad},
          {"rpe_trans_m", errors.rpe_trans_m},
          {"rpe_rot_rad", errors.rpe_rot_rad}};
}

std::string asJson(const TrajectoryErrors& errors) {
  nlohmann::ordered_json json;
  json["matched"] = errors.matched;
  json["scale"] = errors.alignment.scale;
  json["sim3_scale"] = nullptr;
  if (errors.sim3_scale) json["sim3_scale"] = *errors.sim3_scale;
  for (const auto& [name, s] : named(errors)) {
    json[name] = nullptr;
    if (s)
      json[name] = {{"mean", s->mean}, {"std", s->std}, {"median", s->median},
                    {"rmse", s->rmse}, {"min", s->min}, {"max", s->max}};
  }
  return json.dump(2) + "\n";
}

std::string asTable(const TrajectoryErrors& errors) {
  Table table{{"", "mean", "std", "median", "rmse", "min", "max"}, {}};
  for (const auto& [name, s] : named(errors)) {
    std::vector<std::string> row{name};
    if (s)
      for (double value : {s->mean, s->std, s->median, s->rmse, s->min, s->max})
        row.push_back(formatFixed(value, 6));
    table.rows.push_back(row);
  }
  return std::to_string(errors.matched) + " poses matched\n" + formatTable(table);
}

int evaluate(const EvalArguments& arguments) {
  const std::optional<Alignment> alignment = alignmentFromString(arguments.align);
  if (!alignment) throw UsageError("--align " + arguments.align + ": possible: none, se3, sim3");
  const Trajectory estimate = readTum(arguments.estimate), truth = readTum(arguments.truth);
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, *alignment);
  if (errors.matched == 0)
    throw InputError(SourcePlace{arguments.estimate},
                     "no pose has a time stamp of " + arguments.truth,
                     "poses are matched within 0.01 s");
  std::fputs((arguments.json ? asJson(errors) : asTable(errors)).c_str(), stdout);
  return kExitDone;
}

}  // namespace

std::function<int()> setUpEval(CLI::App& app) {
  auto arguments = std::make_shared<EvalArguments>();
  app.add_option("ESTIMATE", arguments->estimate, "estimated trajectory (TUM file)")->required();
  app.add_option("TRUTH", arguments->truth, "true trajectory (TUM file)")->required();
  app.add_option("--align", arguments->align,
                 "none, se3 or sim3: how the estimate is laid over the truth")
      ->capture_default_str();
  app.add_flag("--json", arguments->json, "print JSON instead of a table");
  return [arguments] { return evaluate(*arguments); };
}

}  // namespace diorama
