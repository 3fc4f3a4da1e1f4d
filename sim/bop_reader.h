// Reads a scene of a BOP data set: our own (sim/bop_writer.h) or another's.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/json_values.h"
#include "sim/sequence_reader.h"

namespace diorama {

// The scene's folder that a path means: the folder with scene_camera.json itself, or a data set
// (or a folder with one in `bop/`) that has a single scene. Nothing when there is no BOP data.
// Throws InputError when there are several scenes.
std::optional<std::filesystem::path> findBopScene(const std::filesystem::path& path);

// The images come in the order of their ids. Truth is what scene_gt.json has, the world that of
// cam_R_w2c; without it, a scene is taken to rest, and the frame of its first annotated object is
// the world. Without `timestamp_ns` (ours) the frames are 1/30 s apart by id. The initial poses are
// those of the first image. One camera for all images; the names of objects are `name` of
// models_info.json (ours) or obj_000001, with _2 and so on for further instances.
class BopReader : public FrameSource {
 public:
  // `scene` is what findBopScene() returned. Throws MissingInputError or InputError.
  explicit BopReader(const std::filesystem::path& scene,
                     TruthImages truth_images = TruthImages::kAll);

  const Camera& camera() const override { return camera_; }
  int frameCount() const override { return static_cast<int>(images_.size()); }
  FrameAndTruth read(int index) override;  // thread-safe, as SequenceReader's

  std::string name() const { return scene_.filename().string(); }
  const std::vector<SequenceObject>& objects() const { return objects_; }
  int64_t timestampNs(int index) const { return images_[static_cast<size_t>(index)].timestamp_ns; }

 private:
  struct Annotation {
    size_t object;  // in objects_
    int index;      // in scene_gt.json, of the masks' files
    SE3 T_camera_object;
    int px_all = -1, px_valid = -1, px_visible = -1;
  };
  struct BopImage {
    int64_t id = 0;
    int64_t timestamp_ns = 0;
    double depth_scale = 1;  // mm per unit
    std::optional<SE3> T_camera_world;
    std::vector<Annotation> annotations;
  };
  struct Intrinsics {
    std::vector<double> K, distortion;
    CameraModel model = CameraModel::kPinhole;
    friend bool operator==(const Intrinsics&, const Intrinsics&) = default;
  };

  Intrinsics readCameras();
  void setCamera(const Intrinsics& intrinsics);
  void readAnnotations();
  void readInfo();
  size_t objectOf(int64_t obj_id, int instance, const JsonValue& place);
  std::filesystem::path imageFile(const std::vector<std::string>& channels, int64_t id) const;
  std::optional<GroundTruth> readTruth(const BopImage& image) const;
  void readTruthImages(const BopImage& image, GroundTruth& truth) const;

  std::filesystem::path scene_, models_;
  TruthImages truth_images_;
  Camera camera_;
  std::vector<BopImage> images_;
  std::vector<SequenceObject> objects_;
  std::map<std::pair<int64_t, int>, size_t> object_index_;  // by obj_id and instance
  std::optional<JsonValue> models_info_;
};

}  // namespace diorama
