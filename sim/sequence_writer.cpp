#include "sim/sequence_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/errors.h"
#include "core/files.h"
#include "core/measurements_io.h"
#include "core/text.h"
#include "core/trajectory.h"
#include "sim/bop_writer.h"
#include "sim/euroc_writer.h"
#include "sim/frame_record.h"
#include "sim/model_files.h"
#include "sim/png_encoder.h"
#include "sim/sequence_files.h"
#include "sim/sequence_names.h"
#include "sim/simulated_odometry.h"
#include "sim/truth_files.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr const char* kRecordFolder = "partial";

uint16_t depthUnits(float depth_m) {
  const double value = std::round(static_cast<double>(depth_m) * kDepthUnitsPerMetre);
  return value >= 0 && value <= 65535 ? static_cast<uint16_t>(value) : uint16_t{0};
}

Image<uint16_t> toDepthUnits(const Image<float>& depth_m) {
  Image<uint16_t> units(depth_m.width, depth_m.height);
  std::transform(depth_m.pixels.begin(), depth_m.pixels.end(), units.pixels.begin(), depthUnits);
  return units;
}

Image<uint8_t> maskOf(const Image<uint16_t>& ids, uint16_t id) {
  Image<uint8_t> mask(ids.width, ids.height);
  for (size_t i = 0; i < ids.pixels.size(); ++i) mask.pixels[i] = ids.pixels[i] == id ? 255 : 0;
  return mask;
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
      formats_(options.formats),
      first_(options.first_frame),
      end_(options.end_frame < 0 ? scene.frameCount() : options.end_frame) {
  DIORAMA_CHECK(0 <= first_ && first_ < end_ && end_ <= scene.frameCount());
  createFolder(folder_ / kRecordFolder);
  const auto create = [&](const char* home, std::initializer_list<const char*> names) {
    for (const char* name : names) createFolder(folder_ / home / name);
  };
  if (writes(SequenceFormat::kTum))
    create("", {"rgb", "depth", "id", "mask", "mask_visib", "objects"});
  if (writes(SequenceFormat::kBop)) {
    create("bop", {"models"});
    create("bop/test/000000", {"rgb", "depth", "mask", "mask_visib"});
  }
  if (writes(SequenceFormat::kEuroc))
    create("euroc/mav0", {"cam0/data", "imu0", "state_groundtruth_estimate0"});
}

bool SequenceWriter::writes(SequenceFormat format) const {
  return std::find(formats_.begin(), formats_.end(), format) != formats_.end();
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

namespace {

// What of a frame goes into image files.
EncodedFrame encode(const Scene& scene, const Frame& frame, const GroundTruth& truth,
                    bool with_grey) {
  const std::vector<size_t> tracked = trackedObjects(scene);
  EncodedFrame encoded;
  encoded.number = frame.index;
  encoded.timestamp_ns = frame.timestamp_ns;
  encoded.picture = frame.rgb.empty() ? encodePng(frame.gray) : encodePng(frame.rgb);
  if (with_grey) encoded.grey = encodePng(frame.gray);
  if (!truth.depth_m.empty()) encoded.depth = encodePng(toDepthUnits(truth.depth_m));
  if (!truth.instance_id.empty()) encoded.ids = encodePng(truth.instance_id);
  for (size_t n = 0; n < tracked.size(); ++n) {
    EncodedFrame::Object object;
    const Image<uint8_t>& mask = truth.objects[n].mask;
    if (!mask.empty()) object.mask = encodePng(mask, PngContent::kLabels);
    if (!truth.instance_id.empty())
      object.mask_visib = encodePng(
          maskOf(truth.instance_id, static_cast<uint16_t>(tracked[n] + 1)), PngContent::kLabels);
    encoded.objects.push_back(std::move(object));
  }
  return encoded;
}

void writeTumFrame(const EncodedFrame& frame, SequenceFiles& files) {
  const auto write = [&](const std::string& name, const std::string& png) {
    if (!png.empty()) files.write(name, png);
  };
  write(frameFile("rgb", frame.number), frame.picture);
  write(frameFile("depth", frame.number), frame.depth);
  write(frameFile("id", frame.number), frame.ids);
  for (size_t n = 0; n < frame.objects.size(); ++n) {
    write(maskFile("mask", frame.number, n), frame.objects[n].mask);
    write(maskFile("mask_visib", frame.number, n), frame.objects[n].mask_visib);
  }
}

ObjectPixels pixelsOf(const ObjectTruth& object, const GroundTruth& truth, uint16_t id) {
  ObjectPixels pixels;
  pixels.whole = object.outside;
  const int width = truth.instance_id.width, height = truth.instance_id.height;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (truth.instance_id(x, y) == id) pixels.visible.add(x, y);
      if (object.mask.empty() || !object.mask(x, y)) continue;
      pixels.whole.add(x, y);
      pixels.with_depth += !truth.depth_m.empty() && depthUnits(truth.depth_m(x, y)) > 0;
    }
  return pixels;
}

}  // namespace

void SequenceWriter::write(const Frame& frame, const GroundTruth& truth) {
  DIORAMA_CHECK(first_ <= frame.index && frame.index < end_);
  const std::vector<size_t> tracked = trackedObjects(scene_);
  DIORAMA_CHECK(truth.objects.size() == tracked.size());
  SequenceFiles files(folder_);
  const EncodedFrame encoded = encode(scene_, frame, truth, writes(SequenceFormat::kEuroc));
  if (writes(SequenceFormat::kTum)) writeTumFrame(encoded, files);
  if (writes(SequenceFormat::kBop)) writeBopFrame(encoded, files);
  if (writes(SequenceFormat::kEuroc)) writeEurocFrame(encoded, files);
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
    record.pixels.push_back(pixelsOf(object, truth, static_cast<uint16_t>(tracked[n] + 1)));
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
  TextFiles(const Scene& scene, const std::vector<FrameRecord>& records, SequenceFiles& files)
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
  SequenceFiles& files_;
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
  SequenceFiles files(folder_);
  for (int k = first_; k < end_; ++k) {
    records.push_back(parseRecord(readFile(recordFile(k)), recordFile(k)));
    for (const auto& [name, hash] : records.back().files)
      if (!name.starts_with(kRecordFolder)) files.note(name, hash);
  }
  if (writes(SequenceFormat::kTum)) writeTumTexts(records, files);
  if (writes(SequenceFormat::kBop)) writeBopTexts(scene_, records, first_, files);
  if (writes(SequenceFormat::kEuroc)) writeEurocTexts(scene_, records, files);

  std::string manifest = "file,sha256\n";
  for (const auto& [name, hash] : files.hashes) manifest += name + "," + hash + "\n";
  writeFileAtomically(folder_ / "manifest.csv", manifest);
  std::error_code error;
  fs::remove_all(folder_ / kRecordFolder, error);  // a leftover does no harm
}

void SequenceWriter::writeTumTexts(const std::vector<FrameRecord>& records,
                                   SequenceFiles& files) const {
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
}

}  // namespace diorama
