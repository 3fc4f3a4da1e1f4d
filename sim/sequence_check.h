// Whether a sequence folder proves itself: complete, well formed, and its truth free of
// contradictions: between files, between frames, and with the objects' meshes.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "sim/sequence_reader.h"

namespace diorama {

enum class Check {
  kFiles,       // all there, with the sums of the manifest
  kImages,      // pictures and truth images are whole and of the camera's size
  kTimes,       // increase, and are the same in all files
  kMasks,       // masks part the image as the ids do
  kVisibility,  // visibility.csv counts the pixels of the masks
  kObjects,     // depth and masks are those of the mesh at its pose, pixel by pixel
  kDepth,       // no pixel contradicts the surfaces that other frames show
  kPoses,       // the camera's motion carries the depth of each frame onto the next
  kFlow,        // flow is what depth and poses make of it
  kNormals,     // normals are those of the planes in the depth
};
inline constexpr std::array<const char*, 10> kCheckNames = {
    "files",   "images", "times", "masks", "visibility",
    "objects", "depth",  "poses", "flow",  "normals"};

struct CheckFinding {
  Check check;
  std::string file;  // relative to the sequence
  std::string what;
};

// What one part of the work has found.
struct CheckResult {
  std::vector<CheckFinding> findings;
  std::array<int64_t, kCheckNames.size()> examined{};  // files, pixels or samples

  void add(Check check, const std::string& file, const std::string& what) {
    findings.push_back({check, file, what});
  }
  void count(Check check, int64_t n) { examined[static_cast<size_t>(check)] += n; }
  void append(const CheckResult& other);
};

// The work comes in parts, one per frame; they may be done by several threads at once, in about
// their order. A frame keeps company with eight frames before and after it, no more are in memory.
class SequenceCheck {
 public:
  // Throws MissingInputError where no sequence.yaml is. All else that is wrong is a finding.
  explicit SequenceCheck(std::filesystem::path folder);
  ~SequenceCheck();

  int partCount() const;
  CheckResult checkPart(int part) const;  // thread-safe
  CheckResult checkWhole() const;         // what is about the sequence, not about a frame

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
