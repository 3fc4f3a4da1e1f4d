// The subcommands and what they share: one place where errors become exit codes.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace diorama {

// A subcommand: declares its options on `app` and returns what to do once they are parsed (an exit
// code).
struct Command {
  const char* name;
  const char* summary;
  std::function<int()> (*setUp)(CLI::App& app);
};

std::function<int()> setUpRender(CLI::App& app);
std::function<int()> setUpRun(CLI::App& app);
std::function<int()> setUpTrain(CLI::App& app);
std::function<int()> setUpEval(CLI::App& app);
std::function<int()> setUpReproduce(CLI::App& app);
std::function<int()> setUpSweep(CLI::App& app);
std::function<int()> setUpReport(CLI::App& app);
std::function<int()> setUpCheck(CLI::App& app);
std::function<int()> setUpDoctor(CLI::App& app);

// Parses, runs and returns the exit code; every error is one line on standard error.
int runCommandLine(int argc, const char* const* argv);

// `A:B`, zero-based and half-open, either end may be missing; the frames of a sequence of `count`,
// every `every`-th.
struct FrameRange {
  int begin = 0;
  int end = -1;  // -1 = to the end
};
FrameRange parseFrameRange(const std::string& text);
std::vector<int> framesOf(const FrameRange& range, int count, int every = 1);

// Throws Error(130) when the user asked to stop (SIGINT, SIGTERM).
void throwIfInterrupted();

}  // namespace diorama
