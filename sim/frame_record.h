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

// What BOP wants to know beyond ObjectTruth.
struct ObjectPixels {
  int with_depth = 0;       // pixels of the silhouette for which the depth image has a value
  PixelBox whole, visible;  // of the whole silhouette, also beyond the image; of what is seen
};

struct FrameRecord {
  GroundTruth truth;                                       // without images
  std::vector<ObjectPixels> pixels;                        // one per object of the truth
  std::vector<std::pair<std::string, std::string>> files;  // relative name, SHA-256
};

std::string formatRecord(const FrameRecord& record);

// Throws InputError when the text is not one that formatRecord() made.
FrameRecord parseRecord(const std::string& text, const std::filesystem::path& file);

}  // namespace diorama
