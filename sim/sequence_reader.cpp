#include "sim/sequence_reader.h"

#include <algorithm>
#include <cstdlib>

#include "core/files.h"
#include "core/text.h"
#include "sim/image_file.h"
#include "sim/sequence_names.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// How far the times of a frame and of its truth may be apart.
constexpr int64_t kSameTime_ns = 1000;
constexpr int64_t kMaxGap_ns = 100'000'000;  // between true poses that are interpolated
constexpr double kDepthUnitsPerMetre = 5000;

bool isThere(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

// `000123.png` has the number 123.
std::optional<int> numberOf(const fs::path& file) {
  const std::string stem = file.stem().string();
  if (stem.empty() || stem.size() > 9 || stem.find_first_not_of("0123456789") != std::string::npos)
    return std::nullopt;
  return static_cast<int>(*parseInteger(stem));
}

// `timestamp filename` lines; times are rounded to microseconds.
std::vector<ImageEntry> readImageList(const fs::path& file, const fs::path& folder) {
  const std::string content = readFile(file);
  std::vector<ImageEntry> entries;
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const SourcePlace place{file.string(), number};
    const size_t blank = line.find_first_of(" \t");
    if (blank == std::string_view::npos) throw InputError(place, "expected `timestamp filename`");
    const std::optional<int64_t> time = parseSeconds(line.substr(0, blank));
    if (!time) throw InputError(place, "the timestamp is no number of seconds");
    const int64_t time_ns = (*time >= 0 ? *time + 500 : *time - 500) / 1000 * 1000;
    if (!entries.empty() && time_ns <= entries.back().timestamp_ns)
      throw InputError(place, "the times do not increase");
    const fs::path image = folder / trim(line.substr(blank));
    const int row = static_cast<int>(entries.size());
    entries.push_back({time_ns, image, numberOf(image).value_or(row)});
  }
  if (entries.empty()) throw InputError(file, "lists no images");
  return entries;
}

// A file of the sequence that sequence.yaml names, which must be there.
fs::path namedFile(const YamlValue& value, const fs::path& folder) {
  const fs::path file = folder / value.asString();
  if (!isThere(file))
    throw MissingInputError(value.place(), "there is no file " + file.string(), "");
  return file;
}

}  // namespace

std::optional<SE3> poseAt(const Trajectory& trajectory, int64_t time_ns) {
  if (const StampedPose* exact = trajectory.nearest(time_ns, kSameTime_ns)) return exact->pose;
  const auto after = std::upper_bound(
      trajectory.poses.begin(), trajectory.poses.end(), time_ns,
      [](int64_t time, const StampedPose& pose) { return time < pose.timestamp_ns; });
  if (after == trajectory.poses.begin() || after == trajectory.poses.end()) return std::nullopt;
  const StampedPose& a = *(after - 1);
  const int64_t gap = after->timestamp_ns - a.timestamp_ns;
  if (gap > kMaxGap_ns) return std::nullopt;
  const double share = static_cast<double>(time_ns - a.timestamp_ns) / static_cast<double>(gap);
  return a.pose * exp(share * log(a.pose.inverse() * after->pose));
}

std::vector<SequenceObject> readSequenceObjects(const YamlValue& list, const fs::path& folder) {
  std::vector<SequenceObject> objects;
  for (const YamlValue& value : list.asList()) {
    YamlMap map = value.asMap();
    SequenceObject object;
    const YamlValue name = map.require("name");
    object.name = readName(name);
    for (const SequenceObject& other : objects)
      if (other.name == object.name) name.fail("`" + object.name + "` stands twice");
    object.model = namedFile(map.require("model"), folder);
    if (auto scale = map.find("scale")) object.scale = readNumber(*scale, 1e-9, 1e9);
    if (auto up = map.find("up")) object.y_up = up->asChoice({"z", "y"}) == 1;
    if (auto database = map.find("database")) object.database = namedFile(*database, folder);
    if (auto pose = map.find("initial_T_camera_object"))
      object.initial_T_camera_object = readPose(*pose);
    if (auto symmetries = map.find("symmetries")) object.symmetries = readSymmetries(*symmetries);
    map.finish();
    objects.push_back(std::move(object));
  }
  return objects;
}

std::vector<SequenceObject> loadSequenceObjects(const fs::path& file) {
  YamlMap root = loadYaml(file);
  for (const char* other : {"camera", "images", "odometry"}) root.find(other);
  const YamlValue list = root.require("objects");
  root.finish();
  return readSequenceObjects(list, file.parent_path());
}

SequenceReader::SequenceReader(const fs::path& sequence, TruthImages truth_images)
    : truth_images_(truth_images) {
  std::error_code error;
  const bool is_folder = fs::is_directory(sequence, error);
  folder_ = is_folder ? sequence : sequence.parent_path();
  name_ = fs::absolute(folder_ / "x", error).lexically_normal().parent_path().filename().string();
  YamlMap root = loadYaml(is_folder ? sequence / "sequence.yaml" : sequence);
  YamlMap camera = root.require("camera").asMap();
  camera_ = Camera(readCamera(camera));
  camera.finish();
  const fs::path images = namedFile(root.require("images"), folder_);
  if (auto odometry = root.find("odometry")) odometry_file_ = namedFile(*odometry, folder_);
  const std::optional<YamlValue> objects = root.find("objects");
  root.finish();
  if (objects) objects_ = readSequenceObjects(*objects, folder_);
  images_ = readImageList(images, folder_);
  readTruthFiles();
}

void SequenceReader::readTruthFiles() {
  if (isThere(folder_ / "groundtruth.txt")) T_world_camera_ = readTum(folder_ / "groundtruth.txt");
  for (const SequenceObject& object : objects_) {
    const fs::path file = folder_ / "objects" / (object.name + ".txt");
    T_world_object_.push_back(isThere(file) ? readTum(file) : Trajectory{});
  }
  if (isThere(folder_ / "visibility.csv")) readVisibility(folder_ / "visibility.csv");
  if (isThere(folder_ / "row_poses.csv")) row_poses_.emplace(folder_ / "row_poses.csv");
  if (isThere(folder_ / "depth.txt")) depth_ = readImageList(folder_ / "depth.txt", folder_);
}

void SequenceReader::readVisibility(const fs::path& file) {
  const std::string content = readFile(file);
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || number == 1) continue;
    const SourcePlace place{file.string(), number};
    const std::vector<std::string_view> fields = split(line, ',');
    if (fields.size() < 5)
      throw InputError(place, "expected `frame,object,px_all,px_valid,px_visible,...`");
    const auto frame = parseInteger(fields[0]), all = parseInteger(fields[2]),
               valid = parseInteger(fields[3]), visible = parseInteger(fields[4]);
    constexpr int64_t kMax = 1 << 30;
    for (const auto& count : {frame, all, valid, visible})
      if (!count || *count < 0 || *count > kMax)
        throw InputError(place, "frames and pixel counts must be whole numbers, zero or above");
    visibility_[{static_cast<int>(*frame), std::string(fields[1])}] = {
        static_cast<int>(*all), static_cast<int>(*valid), static_cast<int>(*visible)};
  }
}

std::optional<GroundTruth> SequenceReader::readTruth(const ImageEntry& entry) const {
  const std::optional<SE3> T_world_camera = poseAt(T_world_camera_, entry.timestamp_ns);
  if (!T_world_camera) return std::nullopt;
  GroundTruth truth;
  truth.timestamp_ns = entry.timestamp_ns;
  truth.T_world_camera = *T_world_camera;
  if (row_poses_) truth.row_poses = row_poses_->rowsOf(entry.number, camera_.height());
  for (size_t i = 0; i < objects_.size(); ++i) {
    const std::optional<SE3> pose = poseAt(T_world_object_[i], entry.timestamp_ns);
    if (!pose) continue;
    ObjectTruth object;
    object.name = objects_[i].name;
    object.T_world_object = *pose;
    const auto counts = visibility_.find({entry.number, object.name});
    if (counts != visibility_.end()) {
      object.px_all = counts->second.all;
      object.px_valid = counts->second.valid;
      object.px_visible = counts->second.visible;
    }
    truth.objects.push_back(std::move(object));
  }
  if (truth_images_ == TruthImages::kAll) readTruthImages(entry, truth);
  return truth;
}

void SequenceReader::readTruthImages(const ImageEntry& entry, GroundTruth& truth) const {
  const auto labels = [&](const fs::path& file) {
    const AnyImage image = readImage(file, camera_.width(), camera_.height());
    if (const auto* wide = std::get_if<Image<uint16_t>>(&image)) return *wide;
    throw InputError(file, "must be a grey image of 16 bits");
  };
  for (const ImageEntry& depth : depth_) {
    if (std::abs(depth.timestamp_ns - entry.timestamp_ns) > kSameTime_ns) continue;
    const Image<uint16_t> units = labels(depth.file);
    truth.depth_m = Image<float>(units.width, units.height);
    std::transform(units.pixels.begin(), units.pixels.end(), truth.depth_m.pixels.begin(),
                   [](uint16_t u) { return static_cast<float>(u / kDepthUnitsPerMetre); });
  }
  const fs::path ids = folder_ / frameFile("id", entry.number);
  if (isThere(ids)) truth.instance_id = labels(ids);
  for (ObjectTruth& object : truth.objects) {
    size_t index = 0;
    while (objects_[index].name != object.name) ++index;
    const fs::path file = folder_ / maskFile("mask", entry.number, index);
    if (!isThere(file)) continue;
    AnyImage mask = readImage(file, camera_.width(), camera_.height());
    if (!std::holds_alternative<Image<uint8_t>>(mask))
      throw InputError(file, "must be a grey image of 8 bits");
    object.mask = std::get<Image<uint8_t>>(std::move(mask));
  }
}

FrameAndTruth SequenceReader::read(int index) {
  DIORAMA_CHECK(0 <= index && index < frameCount());
  const ImageEntry& entry = images_[static_cast<size_t>(index)];
  FrameAndTruth result;
  result.frame = readFrame(entry.file, camera_);
  result.frame.index = index;
  result.frame.timestamp_ns = entry.timestamp_ns;
  result.truth = readTruth(entry);
  return result;
}

}  // namespace diorama
