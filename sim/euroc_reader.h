// Reads the first camera of a sequence in the EuRoC layout: our own (sim/euroc_writer.h) or
// another's.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/trajectory.h"
#include "sim/sequence_reader.h"

namespace diorama {

// The mav0 folder that a path means: itself, or the one in it, or in `euroc/`; nothing when there
// is none.
std::optional<std::filesystem::path> findEuroc(const std::filesystem::path& path);

// Times are rounded to microseconds. The true camera is that of state_groundtruth_estimate0 (or
// vicon0, leica0 has no orientation), moved by the T_BS of both sensors. There are no objects in
// this format.
class EurocReader : public FrameSource {
 public:
  // `mav0` is what findEuroc() returned. Throws MissingInputError or InputError.
  explicit EurocReader(const std::filesystem::path& mav0);

  const Camera& camera() const override { return camera_; }
  int frameCount() const override { return static_cast<int>(images_.size()); }
  FrameAndTruth read(int index) override;  // thread-safe, as SequenceReader's

  const std::string& name() const { return name_; }
  int64_t timestampNs(int index) const { return images_[static_cast<size_t>(index)].timestamp_ns; }
  const Trajectory& trueCameraPath() const { return T_world_camera_; }

 private:
  void readTruthPath(const std::filesystem::path& mav0, const SE3& T_body_camera);

  std::string name_;
  Camera camera_;
  std::vector<ImageEntry> images_;
  Trajectory T_world_camera_;
};

}  // namespace diorama
