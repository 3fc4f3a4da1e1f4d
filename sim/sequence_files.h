// What the writers of a sequence share: the files with their sums, and a frame's encoded images.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "core/files.h"
#include "core/sha256.h"
#include "sim/scene.h"

namespace diorama {

inline constexpr double kDepthUnitsPerMetre = 5000;  // TUM RGB-D, in 16 bits

// Writes files and remembers their sums.
class SequenceFiles {
 public:
  explicit SequenceFiles(const std::filesystem::path& folder) : folder_(folder) {}

  void write(const std::string& name, const std::string& content) {
    writeFileAtomically(folder_ / name, content);
    note(name, sha256(content));
  }
  void note(const std::string& name, const std::string& hash) { hashes.emplace_back(name, hash); }
  const std::filesystem::path& folder() const { return folder_; }

  std::vector<std::pair<std::string, std::string>> hashes;

 private:
  const std::filesystem::path& folder_;
};

// PNG files in memory, encoded once for all formats; empty where there is none.
struct EncodedFrame {
  int number = 0;  // in the scene
  int64_t timestamp_ns = 0;
  std::string picture, grey, depth, ids;
  struct Object {
    std::string mask, mask_visib;
  };
  std::vector<Object> objects;  // tracked ones, in the order of the scene
};

// Positions in Scene::objects.
inline std::vector<size_t> trackedObjects(const Scene& scene) {
  std::vector<size_t> tracked;
  for (size_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].tracked) tracked.push_back(i);
  return tracked;
}

}  // namespace diorama
