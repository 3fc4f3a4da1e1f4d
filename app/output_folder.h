// What to do with an output folder that exists: reuse a complete one, refuse to touch any other.
#pragma once

#include <filesystem>
#include <string>

namespace diorama {

// The text that says how a folder's content was made: the same text, the same content.
struct OutputRequest {
  std::filesystem::path folder;
  std::string recipe_file;  // holds the recipe, written first
  std::string marker_file;  // written last: the folder is complete
  std::string recipe;
  bool resumable = false;  // an incomplete folder can be gone on with ...
  bool resume = false;     // ... and is to be
};

enum class OutputState { kComplete, kFresh, kResumed };

// Creates the folder and writes the recipe, unless it is complete already. Throws OutputError (74)
// for a folder with other content.
OutputState prepareOutput(const OutputRequest& request);

}  // namespace diorama
