// A command line as text that a shell takes.
#pragma once

#include <string>
#include <vector>

#include "app/run_setup.h"

namespace diorama {

// Quoted only where it must be.
std::string shellWord(const std::string& text);
std::string shellLine(const std::vector<std::string>& words);

// The command that repeats a run: everything that differs from the defaults.
std::vector<std::string> repeatCommand(const RunArguments& arguments);

}  // namespace diorama
