#include "core/errors.h"

#include <cstdio>
#include <cstdlib>

namespace diorama {
namespace {

std::string withHint(const std::string& line, const std::string& hint) {
  return hint.empty() ? line : line + "; " + hint;
}

}  // namespace

std::string SourcePlace::toString() const {
  std::string text = file;
  if (line > 0) text += ":" + std::to_string(line);
  if (line > 0 && column > 0) text += ":" + std::to_string(column);
  return text;
}

InputError::InputError(const SourcePlace& place, const std::string& what, const std::string& hint)
    : Error(kExitBadData, withHint(place.toString() + ": " + what, hint)) {}

MissingInputError::MissingInputError(const std::filesystem::path& file, const std::string& hint)
    : Error(kExitMissingInput, withHint(file.string() + ": no such file, or not readable", hint)) {}

MissingInputError::MissingInputError(const SourcePlace& place, const std::string& what,
                                     const std::string& hint)
    : Error(kExitMissingInput, withHint(place.toString() + ": " + what, hint)) {}

OutputError::OutputError(const std::filesystem::path& file, const std::string& what)
    : Error(kExitOutput, file.string() + ": " + what) {}

void checkFailed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace diorama
