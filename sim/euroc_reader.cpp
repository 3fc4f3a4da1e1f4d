#include "sim/euroc_reader.h"

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "sim/image_file.h"
#include "sim/motion_path.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

bool isFile(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

// sensor.yaml; some are written by OpenCV, whose first line is no YAML.
YamlMap loadSensor(const fs::path& file) {
  std::string text = readFile(file);
  if (text.starts_with("%YAML:")) text[0] = '#';
  return parseYaml(text, file.string());
}

// T_BS: {cols: 4, rows: 4, data: [16 numbers]}; the identity when there is none.
SE3 readExtrinsics(YamlMap& sensor) {
  const auto value = sensor.find("T_BS");
  if (!value) return {};
  YamlMap map = value->asMap();
  map.find("cols");
  map.find("rows");
  return readRigid(map.require("data"));
}

CameraParameters readCameraParameters(YamlMap& sensor) {
  CameraParameters c;
  const YamlValue resolution = sensor.require("resolution");
  const std::vector<double> size = resolution.asDoubles();
  constexpr double kMaxSide_px = 16384;
  if (size.size() != 2 || !(size[0] >= 1 && size[0] <= kMaxSide_px) ||
      !(size[1] >= 1 && size[1] <= kMaxSide_px))
    resolution.fail("must be [width, height]");
  c.width = static_cast<int>(size[0]);
  c.height = static_cast<int>(size[1]);
  if (auto model = sensor.find("camera_model")) model->asChoice({"pinhole"});
  const YamlValue intrinsics = sensor.require("intrinsics");
  const std::vector<double> k = intrinsics.asDoubles();
  if (k.size() != 4) intrinsics.fail("must be [fu, fv, cu, cv]");
  c.fx = k[0], c.fy = k[1], c.cx = k[2], c.cy = k[3];
  if (auto list = sensor.find("distortion_coefficients")) c.distortion = list->asDoubles();
  c.model = CameraModel::kRadTan;
  if (auto model = sensor.find("distortion_model"))
    if (model->asChoice({"radial-tangential", "equidistant", "radtan"}) == 1)
      c.model = CameraModel::kFisheye;
  if (const auto problem = c.problem()) sensor.fail(*problem);
  return c;
}

int64_t toMicroseconds(int64_t ns) { return (ns >= 0 ? ns + 500 : ns - 500) / 1000 * 1000; }

// `timestamp [ns],filename`
std::vector<ImageEntry> readImages(const fs::path& camera) {
  const fs::path file = camera / "data.csv";
  const std::string content = readFile(file);
  constexpr int64_t kLatest_ns = INT64_MAX / 2;
  std::vector<ImageEntry> images;
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const SourcePlace place{file.string(), number};
    const std::vector<std::string_view> fields = split(line, ',');
    if (fields.size() != 2) throw InputError(place, "expected `timestamp,filename`");
    const auto time = parseInteger(trim(fields[0]));
    if (!time || *time < 0 || *time > kLatest_ns)
      throw InputError(place, "the timestamp is no number of nanoseconds");
    const int64_t time_ns = toMicroseconds(*time);
    if (!images.empty() && time_ns <= images.back().timestamp_ns)
      throw InputError(place, "the times do not increase");
    images.push_back({time_ns, camera / "data" / trim(fields[1]), static_cast<int>(images.size())});
  }
  if (images.empty()) throw InputError(file, "lists no images");
  return images;
}

}  // namespace

std::optional<fs::path> findEuroc(const fs::path& path) {
  for (const fs::path& folder : {path, path / "mav0", path / "euroc/mav0"})
    if (isFile(folder / "cam0/sensor.yaml") || isFile(folder / "cam0/data.csv")) return folder;
  return std::nullopt;
}

EurocReader::EurocReader(const fs::path& mav0) {
  const fs::path home = fs::absolute(mav0 / "x").lexically_normal().parent_path().parent_path();
  name_ = home.filename().string();
  YamlMap sensor = loadSensor(mav0 / "cam0/sensor.yaml");
  camera_ = Camera(readCameraParameters(sensor));
  const SE3 T_body_camera = readExtrinsics(sensor);
  images_ = readImages(mav0 / "cam0");
  readTruthPath(mav0, T_body_camera);
}

void EurocReader::readTruthPath(const fs::path& mav0, const SE3& T_body_camera) {
  for (const char* name : {"state_groundtruth_estimate0", "vicon0"}) {
    const fs::path folder = mav0 / name;
    if (!isFile(folder / "data.csv")) continue;
    SE3 T_body_sensor;
    if (isFile(folder / "sensor.yaml")) {
      YamlMap sensor = loadSensor(folder / "sensor.yaml");
      T_body_sensor = readExtrinsics(sensor);
    }
    const SE3 T_sensor_camera = T_body_sensor.inverse() * T_body_camera;
    T_world_camera_ = readRecording(folder / "data.csv", RecordingFormat::kEuroc);
    for (StampedPose& stamped : T_world_camera_.poses)
      stamped.pose = stamped.pose * T_sensor_camera;
    return;
  }
}

FrameAndTruth EurocReader::read(int index) {
  DIORAMA_CHECK(0 <= index && index < frameCount());
  const ImageEntry& entry = images_[static_cast<size_t>(index)];
  FrameAndTruth result;
  result.frame = readFrame(entry.file, camera_);
  result.frame.index = index;
  result.frame.timestamp_ns = entry.timestamp_ns;
  if (const auto pose = poseAt(T_world_camera_, entry.timestamp_ns)) {
    result.truth.emplace();
    result.truth->timestamp_ns = entry.timestamp_ns;
    result.truth->T_world_camera = *pose;
  }
  return result;
}

}  // namespace diorama
