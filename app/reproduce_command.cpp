#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include "app/child_process.h"
#include "app/command_line.h"
#include "app/metrics_json.h"
#include "app/paper.h"
#include "app/progress.h"
#include "app/reproduce_tables.h"
#include "app/run_setup.h"
#include "app/task_queue.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"
#include "eval/report_page.h"
#include "sim/scene.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr int kQuickFrames = 150;
constexpr double kTimeLimit_s = 3600;  // of one child process

struct ReproduceArguments {
  std::string output = "reproduce", odometry = "vo", initial = "detect";
  int processes = 2;
  int frames = 0;  // of each scene, from its first; 0 = all
  bool quick = false, resume = false;
};

// One scene's pictures and runs; the names hold a hash of everything that decides their content.
struct Part {
  fs::path scene, sequence;
  std::array<fs::path, 3> runs;
};

std::string hashOf(const std::string& text) { return sha256(text).substr(0, 12); }

std::vector<Part> makeParts(const ReproduceArguments& arguments) {
  std::vector<Part> parts;
  const fs::path output = arguments.output;
  for (const PaperSequence& paper : kPaper) {
    Part part;
    part.scene = dataFolder() / "scenes" / (std::string(paper.scene) + ".yaml");
    const std::string pictures = programCommit() + describeScene(loadScene(part.scene, {})) +
                                 std::to_string(arguments.frames);
    part.sequence = output / "sequences" / (std::string(paper.scene) + "-" + hashOf(pictures));
    for (size_t m = 0; m < kMethods.size(); ++m) {
      const std::string options =
          pictures + "\n" + kMethods[m] + " " + arguments.odometry + " " + arguments.initial;
      part.runs[m] =
          output / "runs" / (std::string(paper.scene) + "-" + kMethods[m] + "-" + hashOf(options));
    }
    parts.push_back(std::move(part));
  }
  return parts;
}

void runOrFail(const std::vector<std::string>& command, const fs::path& log) {
  const ChildResult child = runChild(command, log, {kTimeLimit_s, 0});
  if (!child.done())
    throw Error(kExitInternal,
                log.string() + ": " + command[1] + " " + command[2] + " did not end well (" +
                    (child.timed_out ? "too slow"
                     : child.signal  ? "signal " + std::to_string(child.signal)
                                     : "exit code " + std::to_string(child.exit_code)) +
                    ")");
}

class Reproduction {
 public:
  Reproduction(const ReproduceArguments& arguments, const std::vector<Part>& parts)
      : arguments_(arguments),
        log_(fs::path(arguments.output) / "log.txt"),
        progress_("steps", static_cast<int>(4 * parts.size()), "steps") {
    for (const Part& part : parts) queue_.add([this, part] { film(part); });
  }
  void run() { queue_.run(arguments_.processes); }

 private:
  void film(const Part& part) {
    if (!fs::exists(part.sequence / "manifest.csv")) {
      std::vector<std::string> command = {
          thisProgram(), "render", part.scene.string(), "-o", part.sequence.string(), "--resume"};
      if (arguments_.frames > 0)
        command.insert(command.end(), {"--frames", "0:" + std::to_string(arguments_.frames)});
      runOrFail(command, log_);
    }
    count();
    for (size_t m = 0; m < kMethods.size(); ++m)
      queue_.addFirst([this, part, m] { measure(part, m); });
  }

  void measure(const Part& part, size_t m) {
    if (!fs::exists(part.runs[m] / "metrics.json")) {
      std::error_code ignored;
      fs::remove_all(part.runs[m], ignored);  // of a process that was stopped
      runOrFail({thisProgram(), "run", part.sequence.string(), "-o", part.runs[m].string(),
                 "--method", kMethods[m], "--odometry", arguments_.odometry, "--initial",
                 arguments_.initial, "--no-video", "--no-report"},
                log_);
    }
    count();
  }

  void count() {
    const std::lock_guard lock(mutex_);
    progress_.update(++done_);
  }

  const ReproduceArguments& arguments_;
  fs::path log_;
  TaskQueue queue_;
  std::mutex mutex_;
  Progress progress_;
  int done_ = 0;
};

std::vector<ReproducedSequence> readSequences(const std::vector<Part>& parts) {
  std::vector<ReproducedSequence> sequences;
  for (size_t s = 0; s < parts.size(); ++s) {
    ReproducedSequence sequence{kPaper[s].title, parts[s].runs, {}};
    for (size_t m = 0; m < kMethods.size(); ++m)
      sequence.metrics[m] = metricsFromJson(parts[s].runs[m] / "metrics.json");
    sequences.push_back(std::move(sequence));
  }
  return sequences;
}

void writePage(const fs::path& file, const std::string& lead,
               const std::vector<ReproducedTable>& tables, const std::string& figure) {
  nlohmann::ordered_json data = {{"kind", "reproduce"}, {"headline", lead}, {"figure", figure}};
  data["tables"] = nlohmann::ordered_json::array();
  for (const ReproducedTable& table : tables)
    data["tables"].push_back({{"title", table.title},
                              {"note", table.note},
                              {"header", table.table.header},
                              {"rows", table.table.rows}});
  writeFileAtomically(file, reportPage({"The paper's tables", data.dump(), {}}));
}

int reproduce(const ReproduceArguments& arguments) {
  if (arguments.processes < 1) throw UsageError("-j must be at least 1");
  const fs::path output = arguments.output;
  const std::vector<Part> parts = makeParts(arguments);
  for (const char* name : {"sequences", "runs"}) createFolder(output / name);
  Reproduction(arguments, parts).run();

  const std::vector<ReproducedSequence> sequences = readSequences(parts);
  const std::vector<ReproducedTable> tables = reproducedTables(sequences);
  const std::string lead = headline(sequences), figure = errorFigure(errorPanels(sequences));
  for (const ReproducedTable& table : tables)
    std::printf("%s\n%s\n%s\n", table.title.c_str(), formatTable(table.table).c_str(),
                table.note.c_str());
  std::printf("%s\n", lead.c_str());
  writeFileAtomically(output / "figure4.svg", figure);
  writeFileAtomically(output / "tables.md", lead + "\n\n" + toMarkdown(tables));
  writePage(output / "report.html", lead, tables, figure);
  std::printf("report: %s\n", (output / "report.html").c_str());
  return kExitDone;
}

}  // namespace

std::function<int()> setUpReproduce(CLI::App& app) {
  auto arguments = std::make_shared<ReproduceArguments>();
  app.add_option("-o,--output", arguments->output, "folder to write; what is in it is used again")
      ->capture_default_str();
  app.add_option("-j,--jobs", arguments->processes, "processes at a time")->capture_default_str();
  app.add_option("--odometry", arguments->odometry, "vo or simulated")->capture_default_str();
  app.add_option("--initial", arguments->initial, "detect or given")->capture_default_str();
  app.add_option("--frames", arguments->frames, "only the first so many frames of each scene")
      ->check(CLI::PositiveNumber);
  app.add_flag("--quick", arguments->quick, "the same as --frames 150");
  app.add_flag("--resume", arguments->resume, "go on where it was stopped (as it does anyway)");
  return [arguments] {
    if (arguments->quick && arguments->frames == 0) arguments->frames = kQuickFrames;
    return reproduce(*arguments);
  };
}

}  // namespace diorama
