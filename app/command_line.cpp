#include "app/command_line.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>

#include "app/progress.h"
#include "core/errors.h"
#include "core/text.h"

namespace diorama {
namespace {

constexpr Command kCommands[] = {
    {"render", "film a scene: pictures and exact ground truth as a sequence folder", setUpRender},
    {"run", "track, map and measure on a scene or a sequence", setUpRun},
    {"train", "learn what an object looks like from its CAD model, to detect it", setUpTrain},
    {"eval", "compare two trajectories (TUM files)", setUpEval},
    {"reproduce", "the paper's tables and figure, from six scenes and three methods",
     setUpReproduce},
    {"sweep", "run a grid of scenes and options, and find where it breaks", setUpSweep},
    {"report", "the results of a run or sweep as one page that a browser shows", setUpReport},
    {"check", "prove that a sequence is complete and free of contradictions", setUpCheck},
    {"doctor", "check this installation", setUpDoctor},
};

std::atomic<int> g_signal{0};  // a signal handler can reach nothing else

void onSignal(int signal) { g_signal = signal; }

void setUpLogging() {
  auto logger = spdlog::stderr_color_mt(
      "diorama", terminalWanted() ? spdlog::color_mode::always : spdlog::color_mode::never);
  logger->set_pattern("%v");
  spdlog::set_default_logger(logger);
}

int report(const Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return error.code();
}

std::string unknown(const std::string& kind, const std::string& name,
                    const std::vector<std::string>& possible) {
  return "unknown " + kind + " `" + name + "`" + didYouMean(name, possible);
}

// What was not understood, and whose help says more.
std::string complaint(const CLI::App& app, const std::string& what, int argc,
                      const char* const* argv) {
  const std::vector<const CLI::App*> parsed = app.get_subcommands({});
  const auto command =
      std::find_if(parsed.begin(), parsed.end(), [](const CLI::App* sub) { return sub->parsed(); });
  std::string line = what, place = "diorama";
  if (command != parsed.end()) {
    std::vector<std::string> options;
    for (const CLI::Option* option : (*command)->get_options())
      options.push_back(option->get_name());
    for (int i = 2; i < argc; ++i) {
      const std::string word = argv[i], name = word.substr(0, word.find('='));
      if (!name.starts_with("--") || (*command)->get_option_no_throw(name)) continue;
      line = unknown("option", name, options);
      break;
    }
    place += " " + (*command)->get_name();
  } else if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> names;
    for (const Command& known : kCommands) names.emplace_back(known.name);
    line = unknown("command", argv[1], names);
  }
  return line + "; see " + place + " --help";
}

int parseAndRun(int argc, const char* const* argv) {
  CLI::App app{"Diorama: synthetic scenes and object SLAM, closed loop", "diorama"};
  app.set_version_flag("--version", DIORAMA_VERSION);
  app.require_subcommand(1);
  std::function<int()> action;
  for (const Command& command : kCommands) {
    CLI::App* sub = app.add_subcommand(command.name, command.summary);
    sub->parse_complete_callback([&action, run = command.setUp(*sub)] { action = run; });
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "diorama: %s\n", complaint(app, error.what(), argc, argv).c_str());
    return kExitUsage;
  }
  return action();
}

}  // namespace

void throwIfInterrupted() {
  if (g_signal != 0) throw Error(kExitInterrupted, "interrupted");
}

FrameRange parseFrameRange(const std::string& text) {
  const auto fail = [&] {
    throw UsageError("--frames " + text + ": expected A:B, zero-based and half-open");
  };
  const std::vector<std::string_view> ends = split(text, ':');
  if (ends.size() != 2) fail();
  FrameRange range;
  if (!ends[0].empty()) {
    const std::optional<int64_t> begin = parseInteger(ends[0]);
    if (!begin || *begin < 0 || *begin > 1000000000) fail();
    range.begin = static_cast<int>(*begin);
  }
  if (!ends[1].empty()) {
    const std::optional<int64_t> end = parseInteger(ends[1]);
    if (!end || *end <= range.begin || *end > 1000000000) fail();
    range.end = static_cast<int>(*end);
  }
  return range;
}

std::vector<int> framesOf(const FrameRange& range, int count, int every) {
  const int end = range.end < 0 ? count : std::min(range.end, count);
  if (range.begin >= end)
    throw UsageError("--frames: there are only " + std::to_string(count) + " frames");
  if (range.end > count)
    std::fprintf(stderr, "--frames: there are only %d frames; going up to the last\n", count);
  std::vector<int> frames;
  for (int frame = range.begin; frame < end; frame += every) frames.push_back(frame);
  return frames;
}

int runCommandLine(int argc, const char* const* argv) {
  std::signal(SIGINT, onSignal);
  std::signal(SIGTERM, onSignal);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit of file sizes is reported as a full disk is
  setUpLogging();
  try {
    return parseAndRun(argc, argv);
  } catch (const Error& error) {
    return report(error);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "diorama: out of memory\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "diorama: internal error: %s\n", error.what());
  }
  return kExitInternal;
}

}  // namespace diorama
