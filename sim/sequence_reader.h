// Reads a sequence directory: rendered, or made by hand from real images.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frame_source.h"
#include "core/object_model.h"
#include "core/trajectory.h"
#include "core/yaml.h"
#include "sim/row_pose_table.h"

namespace diorama {

// An object of sequence.yaml, file names resolved.
struct SequenceObject {
  std::string name;
  std::filesystem::path model;  // the mesh file; it exists
  double scale = 1;             // metres per unit of the file
  bool y_up = false;            // the file's y axis points up
  std::optional<std::filesystem::path> database;
  std::optional<SE3> initial_T_camera_object;  // in the first frame
  Symmetries symmetries;
};

// Which truth images read() decodes; poses and pixel counts always come along.
enum class TruthImages { kNone, kAll };

// A line of rgb.txt or depth.txt.
struct ImageEntry {
  int64_t timestamp_ns = 0;
  std::filesystem::path file;
  int number = 0;  // of the frame in its scene
};

// A list of objects as in sequence.yaml; file names are relative to the folder.
std::vector<SequenceObject> readSequenceObjects(const YamlValue& list,
                                                const std::filesystem::path& folder);
// The `objects` of a YAML file: of a sequence.yaml, or of a file with nothing else.
std::vector<SequenceObject> loadSequenceObjects(const std::filesystem::path& file);

// The pose at a time: that of the file, else between its neighbours along the geodesic when they
// are not further apart than 0.1 s.
std::optional<SE3> poseAt(const Trajectory& trajectory, int64_t time_ns);

class SequenceReader : public FrameSource {
 public:
  // `sequence` is the folder, or the sequence.yaml in it. Throws MissingInputError or InputError
  // with file:line:column; images are opened by read() only.
  explicit SequenceReader(const std::filesystem::path& sequence,
                          TruthImages truth_images = TruthImages::kAll);

  const Camera& camera() const override { return camera_; }
  int frameCount() const override { return static_cast<int>(images_.size()); }

  // Frame.index is `index`, the row of rgb.txt from 0. Truth is filled as far as its files are
  // there, and is nothing without a true camera pose; the image never depends on it. Thread-safe.
  // Throws InputError or MissingInputError naming the file.
  FrameAndTruth read(int index) override;

  const std::string& name() const { return name_; }  // of the folder
  const std::vector<SequenceObject>& objects() const { return objects_; }
  int64_t timestampNs(int index) const { return images_[static_cast<size_t>(index)].timestamp_ns; }
  // The number of a frame in its scene: the image file's name when that is a number, else `index`.
  int frameNumber(int index) const { return images_[static_cast<size_t>(index)].number; }
  // Measurements of the odometry sensor (core/measurements_io.h), when sequence.yaml names them.
  const std::optional<std::filesystem::path>& odometryFile() const { return odometry_file_; }
  // True T_world_camera of the whole sequence; empty when not known.
  const Trajectory& trueCameraPath() const { return T_world_camera_; }
  // True T_world_object, one per object; empty where not known.
  const std::vector<Trajectory>& trueObjectPaths() const { return T_world_object_; }
  const std::vector<ImageEntry>& images() const { return images_; }
  const std::vector<ImageEntry>& depthImages() const { return depth_; }

  // The truth of a frame alone, as read() gives it.
  std::optional<GroundTruth> readTruth(int index) const {
    return readTruth(images_[static_cast<size_t>(index)]);
  }

 private:
  struct PixelCounts {
    int all = -1, valid = -1, visible = -1;
  };

  void readTruthFiles();
  void readVisibility(const std::filesystem::path& file);
  std::optional<GroundTruth> readTruth(const ImageEntry& entry) const;
  void readTruthImages(const ImageEntry& entry, GroundTruth& truth) const;

  std::filesystem::path folder_;
  TruthImages truth_images_;
  std::string name_;
  Camera camera_;
  std::vector<ImageEntry> images_;
  std::vector<SequenceObject> objects_;
  std::optional<std::filesystem::path> odometry_file_;
  Trajectory T_world_camera_;
  std::vector<Trajectory> T_world_object_;                         // one per object, may be empty
  std::map<std::pair<int, std::string>, PixelCounts> visibility_;  // by frame number and object
  std::vector<ImageEntry> depth_;
  std::optional<RowPoseTable> row_poses_;
};

}  // namespace diorama
