// Errors that end a command, each with its exit code, and the check for programming errors.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

namespace diorama {

enum ExitCode {
  kExitDone = 0,
  kExitMissed = 1,  // an --expect or threshold was missed, or a check failed
  kExitUsage = 2,
  kExitBadData = 65,
  kExitMissingInput = 66,
  kExitInternal = 70,
  kExitOutput = 74,
  kExitInterrupted = 130,
};

// Something outside the program is wrong. what() is one line: `file:line:column: problem; hint`.
class Error : public std::runtime_error {
 public:
  Error(ExitCode code, const std::string& line) : std::runtime_error(line), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

// Where in a file something is wrong; line and column count from 1, 0 = not known.
struct SourcePlace {
  std::string file;
  int line = 0;
  int column = 0;
  std::string toString() const;
};

// Bad data or configuration (65).
class InputError : public Error {
 public:
  InputError(const SourcePlace& place, const std::string& what, const std::string& hint = "");
  InputError(const std::filesystem::path& file, const std::string& what,
             const std::string& hint = "")
      : InputError(SourcePlace{file.string()}, what, hint) {}
};

// A file that is not there or cannot be opened (66).
class MissingInputError : public Error {
 public:
  explicit MissingInputError(const std::filesystem::path& file, const std::string& hint = "");
  // The same, with the place that names the file.
  MissingInputError(const SourcePlace& place, const std::string& what, const std::string& hint);
};

// An output that could not be written (74).
class OutputError : public Error {
 public:
  OutputError(const std::filesystem::path& file, const std::string& what);
};

// A command line that cannot be understood (2).
class UsageError : public Error {
 public:
  explicit UsageError(const std::string& what) : Error(kExitUsage, what) {}
};

// Ends the program with a message on standard error: the program itself is wrong.
[[noreturn]] void checkFailed(const char* condition, const char* file, int line);

}  // namespace diorama

#define DIORAMA_CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::diorama::checkFailed(#condition, __FILE__, __LINE__))
