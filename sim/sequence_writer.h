// Writes a sequence directory: images, truth and the files that describe them, in the TUM RGB-D
// layout with everything that a tracker needs to be tested, and in those of other benchmarks.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/ground_truth.h"
#include "sim/scene.h"

namespace diorama {

enum class SequenceFormat {
  kTum,   // the sequence folder of `run`: TUM RGB-D and more
  kBop,   // bop/: see sim/bop_writer.h
  kEuroc  // euroc/: see sim/euroc_writer.h
};

struct SequenceWriterOptions {
  int first_frame = 0;  // of the scene
  int end_frame = -1;   // half-open; -1: to the end of the scene
  std::vector<SequenceFormat> formats = {SequenceFormat::kTum};
};

struct FrameRecord;
class SequenceFiles;

// Frames may be written in any order. Every file appears complete or not at all. The manifest
// (file, SHA-256) is written last, by finish(): where it is, the sequence is complete. Until then
// each finished frame leaves a small record in SEQ/partial/, from which finish() makes the text
// files, so that memory does not grow and an interrupted sequence can be gone on with.
// All functions throw OutputError when something cannot be written.
class SequenceWriter {
 public:
  // Creates the folders. The scene must outlive the writer; the range must lie within it.
  SequenceWriter(std::filesystem::path folder, const Scene& scene,
                 const SequenceWriterOptions& options = {});

  // Whether all files of this frame are there already, from an earlier run with the same options.
  bool has(int frame) const;

  // Encodes and writes one frame of the range; frame.index counts in the scene. Thread-safe for
  // distinct frames. Channels that are empty in the truth are not written; the truth's objects are
  // the scene's tracked ones, in its order. Depth beyond 13.1 m is written as 0.
  void write(const Frame& frame, const GroundTruth& truth);

  // Writes everything else (trajectories, models, sequence.yaml, odometry.csv, the manifest).
  // Every frame of the range must have been written.
  void finish();

 private:
  std::filesystem::path recordFile(int frame) const;
  bool writes(SequenceFormat format) const;
  void writeTumTexts(const std::vector<FrameRecord>& records, SequenceFiles& files) const;

  std::filesystem::path folder_;
  const Scene& scene_;
  std::vector<SequenceFormat> formats_;
  int first_;
  int end_;
};

}  // namespace diorama
