// Runs a program and keeps what it says.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "core/files.h"
#include "tests/support/temporary_folder.h"

namespace diorama::test {

struct ProgramResult {
  int code = -1;
  std::string out, err;
};

inline std::string shellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// Through the shell, in `folder`; the command is taken as it is.
inline ProgramResult runShell(const std::string& command, const std::filesystem::path& folder,
                              const TemporaryFolder& scratch) {
  const std::filesystem::path out = scratch / "stdout.txt", err = scratch / "stderr.txt";
  const std::string line = "cd " + shellQuoted(folder.string()) + " && { " + command + "\n} >" +
                           shellQuoted(out.string()) + " 2>" + shellQuoted(err.string()) +
                           " </dev/null";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readFile(out), readFile(err)};
}

inline ProgramResult runDiorama(const std::vector<std::string>& arguments,
                                const TemporaryFolder& scratch) {
  std::string command = shellQuoted(DIORAMA_BINARY);
  for (const std::string& argument : arguments) command += " " + shellQuoted(argument);
  return runShell(command, DIORAMA_SOURCE_DIR, scratch);
}

}  // namespace diorama::test
