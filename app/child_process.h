// Runs a program as a child that ends with its parent, within limits.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace diorama {

struct ChildLimits {
  double time_s = 600;
  double file_mb = 0;  // of one file that it writes; 0 = none
};

struct ChildResult {
  bool timed_out = false;
  int exit_code = -1;  // -1: ended by a signal
  int signal = 0;
  double wall_s = 0;
  bool done() const { return exit_code == 0 && !timed_out; }
};

// What it says goes to `log`. Waits; throws Error(130) when the user asks to stop, and then the
// child is gone. Throws OutputError when the log cannot be written or no process can be made.
// The kernel ends the child when the calling thread ends for whatever reason (SIGKILL included).
ChildResult runChild(const std::vector<std::string>& command, const std::filesystem::path& log,
                     const ChildLimits& limits);

// The program that is running.
std::filesystem::path thisProgram();

}  // namespace diorama
