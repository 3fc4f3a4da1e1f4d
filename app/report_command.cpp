#include <cstdio>

#include "app/command_line.h"
#include "app/run_report.h"
#include "app/sweep_report.h"
#include "core/errors.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

struct ReportArguments {
  std::string first, second, output = "report.html";
};

int report(const ReportArguments& arguments) {
  if (isSweepFolder(arguments.first)) {
    if (!arguments.second.empty()) throw UsageError("a sweep is not compared with another folder");
    writeSweepReport(arguments.first, arguments.output);
    std::printf("report: %s\n", arguments.output.c_str());
    return kExitDone;
  }
  std::vector<fs::path> runs = {arguments.first};
  if (!arguments.second.empty()) runs.emplace_back(arguments.second);
  for (const fs::path& run : runs)
    if (!isRunFolder(run))
      throw MissingInputError(run / "metrics.json",
                              "expected the folder of a complete run or of a sweep");
  writeRunReport(runs, arguments.output);
  std::printf("report: %s\n", arguments.output.c_str());
  return kExitDone;
}

}  // namespace

std::function<int()> setUpReport(CLI::App& app) {
  auto arguments = std::make_shared<ReportArguments>();
  app.add_option("RUN", arguments->first, "folder of a run or of a sweep")->required();
  app.add_option("RUN2", arguments->second, "a second run, to compare");
  app.add_option("-o,--output", arguments->output, "page to write")->capture_default_str();
  return [arguments] { return report(*arguments); };
}

}  // namespace diorama
