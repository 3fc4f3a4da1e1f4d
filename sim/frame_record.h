// What a frame adds to the text files of a sequence, kept in a file of its own until all frames are
// there.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/errors.h"
#include "core/ground_truth.h"

namespace diorama {

struct FrameRecord {
  GroundTruth truth;                                       // without images
  std::vector<std::pair<std::string, std::string>> files;  // relative name, SHA-256
};

std::string formatRecord(const FrameRecord& record);

// Throws InputError when the text is not one that formatRecord() made.
FrameRecord parseRecord(const std::string& text, const std::filesystem::path& file);

}  // namespace diorama
