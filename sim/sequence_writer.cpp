#include "sim/sequence_writer.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "core/errors.h"
#include "core/files.h"
#include "core/measurements_io.h"
#include "core/sha256.h"
#include "core/text.h"
#include "core/trajectory.h"
#include "sim/frame_record.h"
#include "sim/model_files.h"
#include "sim/png_encoder.h"
#include "sim/sequence_names.h"
#include "sim/simulated_odometry.h"
#include "sim/truth_files.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kDepthUnitsPerMetre = 5000;  // TUM RGB-D
constexpr const char* kRecordFolder = "partial";

Image<uint16_t> toDepthUnits(const Image<float>& depth_m) {
  Image<uint16_t> units(depth_m.width, depth_m.height);
  for (size_t i = 0; i < depth_m.pixels.size(); ++i) {
    const double value = std::round(static_cast<double>(depth_m.pixels[i]) * kDepthUnitsPerMetre);
    units.pixels[i] = value >= 0 && value <= 65535 ? static_cast<uint16_t>(value) : uint16_t{0};
  }
  return units;
}

Image<uint8_t> maskOf(const Image<uint16_t>& ids, uint16_t id) {
  Image<uint8_t> mask(ids.width, ids.height);
  for (size_t i = 0; i < ids.pixels.size(); ++i) mask.pixels[i] = ids.pixels[i] == id ? 255 : 0;
  return mask;
}

// Writes files and remembers their hashes.
class Files {
 public:
  explicit Files(const fs::path& folder) : folder_(folder) {}

  void write(const std::string& name, const std::string& content) {
    writeFileAtomically(folder_ / name, content);
    note(name, sha256(content));
  }
  void note(const std::string& name, const std::string& hash) { hashes.emplace_back(name, hash); }

  std::vector<std::pair<std::string, std::string>> hashes;

 private:
  const fs::path& folder_;
};

std::vector<size_t> trackedObjects(const Scene& scene) {
  std::vector<size_t> tracked;
  for (size_t i = 0; i < scene.objects.size(); ++i)
    if (scene.objects[i].tracked) tracked.push_back(i);
  return tracked;
}

// The three header lines of TUM's files.
std::string tumHeader(const std::string& title, const Scene& scene, const std::string& columns) {
  return "# " + title + "\n# scene: " + scene.name + "\n# " + columns + "\n";
}

}  // namespace

SequenceWriter::SequenceWriter(fs::path folder, const Scene& scene,
                               const SequenceWriterOptions& options)
    : folder_(std::move(folder)),
      scene_(scene),
      first_(options.first_frame),
      end_(options.end_frame < 0 ? scene.frameCount() : options.end_frame) {
  DIORAMA_CHECK(0 <= first_ && first_ < end_ && end_ <= scene.frameCount());
  for (const char* name : {"rgb", "depth", "id", "mask", "mask_visib", "objects", kRecordFolder})
    createFolder(folder_ / name);
}

fs::path SequenceWriter::recordFile(int frame) const {
  return folder_ / kRecordFolder / (sixDigits(static_cast<size_t>(frame)) + ".txt");
}

// The record is written after the images, and each of these is complete or not there.
bool SequenceWriter::has(int frame) const {
  std::error_code error;
  if (!fs::exists(recordFile(frame), error)) return false;
  try {
    for (const auto& [name, hash] :
         parseRecord(readFile(recordFile(frame)), recordFile(frame)).files)
      if (!fs::exists(folder_ / name, error)) return false;
  } catch (const Error&) {
    return false;
  }
  return true;
}

void SequenceWriter::write(const Frame& frame, const GroundTruth& truth) {
  DIORAMA_CHECK(first_ <= frame.index && frame.index < end_);
  const std::vector<size_t> tracked = trackedObjects(scene_);
  DIORAMA_CHECK(truth.objects.size() == tracked.size());
  Files files(folder_);
  files.write(frameFile("rgb", frame.index),
              frame.rgb.empty() ? encodePng(frame.gray) : encodePng(frame.rgb));
  if (!truth.depth_m.empty())
    files.write(frameFile("depth", frame.index), encodePng(toDepthUnits(truth.depth_m)));
  if (!truth.instance_id.empty())
    files.write(frameFile("id", frame.index), encodePng(truth.instance_id));
  const bool flow_leaves = truth.flow && truth.flow->to >= end_;
  for (const NamedFile& file : truthFiles(frame.index, truth, scene_, kRecordFolder)) {
    if (flow_leaves && file.name.starts_with("flow/")) continue;  // that frame is not written
    createFolder((folder_ / file.name).parent_path());
    files.write(file.name, file.content);
  }

  FrameRecord record;
  record.truth.timestamp_ns = frame.timestamp_ns;
  record.truth.T_world_camera = truth.T_world_camera;
  for (size_t n = 0; n < tracked.size(); ++n) {
    const ObjectTruth& object = truth.objects[n];
    if (!object.mask.empty())
      files.write(maskFile("mask", frame.index, n), encodePng(object.mask, PngContent::kLabels));
    if (!truth.instance_id.empty()) {
      const uint16_t id = static_cast<uint16_t>(tracked[n] + 1);
      files.write(maskFile("mask_visib", frame.index, n),
                  encodePng(maskOf(truth.instance_id, id), PngContent::kLabels));
    }
    ObjectTruth kept;
    kept.name = scene_.objects[tracked[n]].name;
    kept.T_world_object = object.T_world_object;
    kept.px_all = object.px_all;
    kept.px_valid = object.px_valid;
    kept.px_visible = object.px_visible;
    record.truth.objects.push_back(std::move(kept));
  }
  record.files = std::move(files.hashes);
  writeFileAtomically(recordFile(frame.index), formatRecord(record));
}

namespace {

// The text files of a sequence, from the records of its frames.
class TextFiles {
 public:
  TextFiles(const Scene& scene, const std::vector<FrameRecord>& records, Files& files)
      : scene_(scene), records_(records), files_(files), tracked_(trackedObjects(scene)) {}

  void write(int first_frame) {
    writeImageLists();
    writeTrajectories();
    writeVisibility(first_frame);
    writeInstances();
  }

  // `models` has the mesh of each tracked object relative to the sequence.
  void writeDescription(const std::vector<std::string>& models) {
    std::string text = "camera: " + toYaml(scene_.camera) + "\nimages: rgb.txt\n";
    text += "odometry: odometry.csv\nobjects:";
    if (tracked_.empty()) text += " []";
    text += "\n";
    const GroundTruth& first = records_.front().truth;
    for (size_t n = 0; n < tracked_.size(); ++n) {
      const SceneObject& object = scene_.objects[tracked_[n]];
      SE3 T_camera_object = first.T_world_camera.inverse() * first.objects[n].T_world_object;
      T_camera_object.rotation.normalize();
      text += "  - name: " + object.name + "\n    model: " + toYaml(models[n]) +
              "\n    scale: " + formatNumber(object.scale) + "\n";
      if (object.y_up) text += "    up: y\n";
      text += "    initial_T_camera_object: " + toYaml(T_camera_object) + "\n";
      text += "    symmetries: " + toYaml(object.symmetries) + "\n";
    }
    files_.write("sequence.yaml", text);
  }

 private:
  // The files of every frame that lie in a folder, with their times.
  void writeList(const std::string& channel, const std::string& title) {
    std::string text = tumHeader(title, scene_, "timestamp filename");
    bool any = false;
    for (const FrameRecord& record : records_)
      for (const auto& [name, hash] : record.files) {
        if (!name.starts_with(channel + "/")) continue;
        text += formatSeconds(record.truth.timestamp_ns) + " " + name + "\n";
        any = true;
      }
    if (any) files_.write(channel + ".txt", text);
  }

  void writeImageLists() {
    writeList("rgb", "color images");
    writeList("depth", "depth maps");
  }

  void writeTrajectories() {
    const std::string columns = "timestamp tx ty tz qx qy qz qw";
    std::string camera = tumHeader("ground truth trajectory: T_world_camera", scene_, columns);
    for (const FrameRecord& record : records_)
      camera += formatSeconds(record.truth.timestamp_ns) + " " +
                formatPose(record.truth.T_world_camera, ' ') + "\n";
    files_.write("groundtruth.txt", camera);
    for (size_t n = 0; n < tracked_.size(); ++n) {
      const std::string& name = scene_.objects[tracked_[n]].name;
      std::string text = tumHeader(name + ": T_world_object", scene_, columns);
      for (const FrameRecord& record : records_)
        text += formatSeconds(record.truth.timestamp_ns) + " " +
                formatPose(record.truth.objects[n].T_world_object, ' ') + "\n";
      files_.write("objects/" + name + ".txt", text);
    }
  }

  void writeVisibility(int frame) {
    std::string text = "frame,object,px_all,px_valid,px_visible,visible_fraction\n";
    for (const FrameRecord& record : records_) {
      for (const ObjectTruth& o : record.truth.objects)
        if (const std::optional<double> fraction = o.visibleFraction())
          text += std::to_string(frame) + "," + o.name + "," + std::to_string(o.px_all) + "," +
                  std::to_string(o.px_valid) + "," + std::to_string(o.px_visible) + "," +
                  formatNumber(*fraction) + "\n";
      ++frame;
    }
    files_.write("visibility.csv", text);
  }

  void writeInstances() {
    std::string text = "id,name,model,tracked\n";
    for (size_t i = 0; i < scene_.objects.size(); ++i) {
      const SceneObject& object = scene_.objects[i];
      text += std::to_string(i + 1) + "," + object.name + "," + object.mesh.stem().string() + "," +
              (object.tracked ? "1" : "0") + "\n";
    }
    files_.write("instances.csv", text);
  }

  const Scene& scene_;
  const std::vector<FrameRecord>& records_;
  Files& files_;
  std::vector<size_t> tracked_;
};

std::string odometryRecord(const Scene& scene, int first, int end) {
  const SimulatedOdometry odometry(trueCameraPath(scene), scene.odometry, scene.seed);
  std::string text = measurementsHeader();
  for (int k = first + 1; k < end; ++k)
    text += toCsv(odometry.measure(static_cast<size_t>(k - 1), static_cast<size_t>(k)));
  return text;
}

}  // namespace

void SequenceWriter::finish() {
  std::vector<FrameRecord> records;
  Files files(folder_);
  for (int k = first_; k < end_; ++k) {
    records.push_back(parseRecord(readFile(recordFile(k)), recordFile(k)));
    for (const auto& [name, hash] : records.back().files)
      if (!name.starts_with(kRecordFolder)) files.note(name, hash);
  }
  TextFiles text(scene_, records, files);
  text.write(first_);
  files.write("odometry.csv", odometryRecord(scene_, first_, end_));
  files.write("exposures.csv", exposureTable(scene_, first_, end_));
  for (const auto& [name, hash] : joinTables(folder_, kRecordFolder, first_, end_))
    files.note(name, hash);

  std::vector<std::string> models;
  for (size_t i : trackedObjects(scene_)) {
    const std::string home = "models/" + scene_.objects[i].name;
    const std::vector<fs::path> copies = copyModel(scene_.objects[i].mesh, folder_ / home);
    models.push_back(home + "/" + copies.front().generic_string());
    for (const fs::path& copy : copies)
      files.note(home + "/" + copy.generic_string(), sha256(readFile(folder_ / home / copy)));
  }
  text.writeDescription(models);

  std::string manifest = "file,sha256\n";
  for (const auto& [name, hash] : files.hashes) manifest += name + "," + hash + "\n";
  writeFileAtomically(folder_ / "manifest.csv", manifest);
  std::error_code error;
  fs::remove_all(folder_ / kRecordFolder, error);  // a leftover does no harm
}

}  // namespace diorama
