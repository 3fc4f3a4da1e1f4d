#include "sim/bop_reader.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "sim/image_file.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kMetres = 1e-3;  // per millimetre
constexpr double kRate_hz = 30;   // of data sets that have no times
constexpr int64_t kMostImages = 1'000'000;

bool isFile(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error);
}

std::vector<fs::path> foldersIn(const fs::path& folder) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.is_directory(error)) folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  return folders;
}

// Folders with scene_camera.json: SPLIT/SCENE below a data set, or SCENE below a split.
std::vector<fs::path> scenesBelow(const fs::path& folder) {
  std::vector<fs::path> scenes;
  for (const fs::path& child : foldersIn(folder)) {
    if (isFile(child / "scene_camera.json")) scenes.push_back(child);
    for (const fs::path& grandchild : foldersIn(child))
      if (isFile(grandchild / "scene_camera.json")) scenes.push_back(grandchild);
  }
  return scenes;
}

SE3 readTransform(const JsonValue& R, const JsonValue& t) {
  const std::vector<double> r = R.asDoubles(9), mm = t.asDoubles(3);
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
  m.topRightCorner<3, 1>() = kMetres * Vector3d(mm[0], mm[1], mm[2]);
  const Matrix3d rotation = m.topLeftCorner<3, 3>();
  const double skewed =
      (rotation.transpose() * rotation - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(skewed < 1e-2) || rotation.determinant() < 0) R.fail("is no rotation");
  if (!(m.cwiseAbs().maxCoeff() < 1e5)) t.fail("lies beyond 100 km", "millimetres");
  return SE3::fromMatrix(m);
}

int64_t readId(const std::string& key, const JsonValue& value) {
  const auto id = parseInteger(key);
  if (!id || *id < 0 || *id > 999'999'999) value.fail("is no number of an image");
  return *id;
}

Symmetries readSymmetries(const JsonValue& info) {
  Symmetries symmetries;
  if (const auto list = info.find("symmetries_discrete"))
    for (const JsonValue& item : list->asList()) {
      const std::vector<double> m = item.asDoubles(16);
      Eigen::Matrix4d T = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(m.data());
      T.topRightCorner<3, 1>() *= kMetres;
      const Matrix3d R = T.topLeftCorner<3, 3>();
      if (!((R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-2) ||
          !(T.cwiseAbs().maxCoeff() < 1e5))
        item.fail("is no rigid motion");
      symmetries.discrete.push_back(SE3::fromMatrix(T));
    }
  if (const auto list = info.find("symmetries_continuous"))
    for (const JsonValue& item : list->asList()) {
      const std::vector<double> axis = item.require("axis").asDoubles(3);
      const Vector3d direction(axis[0], axis[1], axis[2]);
      if (!(direction.norm() > 1e-9) || !std::isfinite(direction.norm()))
        item.fail("has an axis without direction");
      if (!symmetries.axis) symmetries.axis = direction.normalized();
    }
  return symmetries;
}

}  // namespace

std::optional<fs::path> findBopScene(const fs::path& path) {
  if (isFile(path / "scene_camera.json")) return (path / "").lexically_normal().parent_path();
  std::error_code error;
  const fs::path root = fs::is_directory(path / "bop", error) ? path / "bop" : path;
  const std::vector<fs::path> scenes = scenesBelow(root);
  if (scenes.empty()) return std::nullopt;
  if (scenes.size() > 1)
    throw InputError(root, "has " + std::to_string(scenes.size()) + " scenes",
                     "name one of them, such as " + scenes.front().string());
  return scenes.front();
}

BopReader::BopReader(const fs::path& scene, TruthImages truth_images)
    : scene_(scene), truth_images_(truth_images) {
  const fs::path root = fs::absolute(scene_).lexically_normal().parent_path().parent_path();
  for (const char* name : {"models", "models_cad", "models_fine", "models_eval"}) {
    std::error_code error;
    if (models_.empty() && fs::is_directory(root / name, error)) models_ = root / name;
  }
  if (isFile(models_ / "models_info.json"))
    models_info_ = JsonValue::load(models_ / "models_info.json");
  const Intrinsics intrinsics = readCameras();
  if (isFile(scene_ / "scene_gt.json")) readAnnotations();
  if (isFile(scene_ / "scene_gt_info.json")) readInfo();
  setCamera(intrinsics);
}

// scene_camera.json: the images, and the one camera that took them.
BopReader::Intrinsics BopReader::readCameras() {
  const JsonValue root = JsonValue::load(scene_ / "scene_camera.json");
  std::optional<Intrinsics> common;
  for (const auto& [key, value] : root.members()) {
    BopImage image;
    image.id = readId(key, value);
    image.timestamp_ns = std::llround(1e6 * static_cast<double>(image.id) / kRate_hz) * 1000;
    if (const auto time = value.find("timestamp_ns")) image.timestamp_ns = time->asInteger();
    if (const auto scale = value.find("depth_scale")) image.depth_scale = scale->asDouble();
    const auto R = value.find("cam_R_w2c"), t = value.find("cam_t_w2c");
    if (R && t) image.T_camera_world = readTransform(*R, *t);
    Intrinsics own;
    own.K = value.require("cam_K").asDoubles(9);
    if (const auto model = value.find("distortion_model")) {
      const auto known = cameraModelFromString(model->asString());
      if (!known) model->fail("must be pinhole, radtan or fisheye");
      own.model = *known;
    }
    if (const auto list = value.find("distortion_coefficients")) own.distortion = list->asDoubles();
    if (!common) common = own;
    if (!(own == *common)) value.fail("has another camera than the image before", "one for all");
    images_.push_back(std::move(image));
    if (static_cast<int64_t>(images_.size()) > kMostImages) root.fail("has too many images");
  }
  if (images_.empty()) root.fail("has no images");
  std::sort(images_.begin(), images_.end(),
            [](const BopImage& a, const BopImage& b) { return a.id < b.id; });
  for (size_t i = 1; i < images_.size(); ++i)
    if (images_[i].timestamp_ns <= images_[i - 1].timestamp_ns)
      root.require(std::to_string(images_[i].id)).fail("does not come after the image before it");
  return *common;
}

// Its size is that of the first image.
void BopReader::setCamera(const Intrinsics& intrinsics) {
  const fs::path first = imageFile({"rgb", "gray"}, images_.front().id);
  const ImageSize size = imageSize(first);
  CameraParameters c;
  c.model = intrinsics.model;
  c.width = size.width;
  c.height = size.height;
  c.fx = intrinsics.K[0];
  c.fy = intrinsics.K[4];
  c.cx = intrinsics.K[2];
  c.cy = intrinsics.K[5];
  c.distortion = intrinsics.distortion;
  if (const auto problem = c.problem()) throw InputError(scene_ / "scene_camera.json", *problem);
  camera_ = Camera(c);
}

// The object that an annotation means; made when it is the first.
size_t BopReader::objectOf(int64_t obj_id, int instance, const JsonValue& place) {
  const auto known = object_index_.find({obj_id, instance});
  if (known != object_index_.end()) return known->second;
  if (models_.empty())
    throw MissingInputError(scene_, "the data set has no models/; give `--objects FILE.yaml`");
  SequenceObject object;
  const std::string file = "obj_" + sixDigits(static_cast<size_t>(obj_id));
  object.name = file;
  object.model = models_ / (file + ".ply");
  object.scale = kMetres;
  if (!isFile(object.model))
    throw MissingInputError(object.model, "named in " + (scene_ / "scene_gt.json").string());
  if (models_info_)
    if (const auto info = models_info_->find(std::to_string(obj_id))) {
      object.symmetries = readSymmetries(*info);
      if (const auto name = info->find("name")) object.name = name->asString();
    }
  if (object.name.empty() || object.name.size() > 100 || object.name.front() == '.' ||
      object.name.find_first_of("/\\,\n\r\t \"'") != std::string::npos)
    place.fail("has a model whose name cannot be used");
  if (instance > 0) object.name += "_" + std::to_string(instance + 1);
  for (const SequenceObject& other : objects_)
    if (other.name == object.name) place.fail("has two models of the name " + object.name);
  objects_.push_back(std::move(object));
  return object_index_[{obj_id, instance}] = objects_.size() - 1;
}

void BopReader::readAnnotations() {
  const JsonValue root = JsonValue::load(scene_ / "scene_gt.json");
  for (BopImage& image : images_) {
    const auto list = root.find(std::to_string(image.id));
    if (!list) continue;
    std::map<int64_t, int> instances;
    int index = 0;
    for (const JsonValue& item : list->asList()) {
      const JsonValue id = item.require("obj_id");
      if (id.asInteger() < 0 || id.asInteger() > 999'999) id.fail("is no number of a model");
      Annotation annotation;
      annotation.object = objectOf(id.asInteger(), instances[id.asInteger()]++, item);
      annotation.index = index++;
      annotation.T_camera_object =
          readTransform(item.require("cam_R_m2c"), item.require("cam_t_m2c"));
      image.annotations.push_back(annotation);
    }
  }
  for (const Annotation& annotation : images_.front().annotations)
    objects_[annotation.object].initial_T_camera_object = annotation.T_camera_object;
}

void BopReader::readInfo() {
  const JsonValue root = JsonValue::load(scene_ / "scene_gt_info.json");
  for (BopImage& image : images_) {
    const auto list = root.find(std::to_string(image.id));
    if (!list) continue;
    const std::vector<JsonValue> items = list->asList();
    for (Annotation& annotation : image.annotations) {
      if (static_cast<size_t>(annotation.index) >= items.size()) continue;
      const auto count = [&](const char* key) {
        const JsonValue value = items[static_cast<size_t>(annotation.index)].require(key);
        const int64_t number = value.asInteger();
        if (number < 0 || number > (1 << 30)) value.fail("is no number of pixels");
        return static_cast<int>(number);
      };
      annotation.px_all = count("px_count_all");
      annotation.px_valid = count("px_count_valid");
      annotation.px_visible = count("px_count_visib");
    }
  }
}

fs::path BopReader::imageFile(const std::vector<std::string>& channels, int64_t id) const {
  for (const std::string& channel : channels)
    for (const char* extension : {".png", ".jpg", ".tif"}) {
      const fs::path file = scene_ / channel / (sixDigits(static_cast<size_t>(id)) + extension);
      if (isFile(file)) return file;
    }
  throw MissingInputError(scene_ / channels.front() / (sixDigits(static_cast<size_t>(id)) + ".png"),
                          "or .jpg or .tif");
}

std::optional<GroundTruth> BopReader::readTruth(const BopImage& image) const {
  GroundTruth truth;
  truth.timestamp_ns = image.timestamp_ns;
  if (image.T_camera_world) {
    truth.T_world_camera = image.T_camera_world->inverse();
  } else {
    const auto first = std::find_if(image.annotations.begin(), image.annotations.end(),
                                    [](const Annotation& a) { return a.object == 0; });
    if (first == image.annotations.end()) return std::nullopt;
    truth.T_world_camera = first->T_camera_object.inverse();
  }
  for (const Annotation& a : image.annotations) {
    ObjectTruth object;
    object.name = objects_[a.object].name;
    object.T_world_object = truth.T_world_camera * a.T_camera_object;
    object.px_all = a.px_all;
    object.px_valid = a.px_valid;
    object.px_visible = a.px_visible;
    truth.objects.push_back(std::move(object));
  }
  if (truth_images_ == TruthImages::kAll) readTruthImages(image, truth);
  return truth;
}

void BopReader::readTruthImages(const BopImage& image, GroundTruth& truth) const {
  const int width = camera_.width(), height = camera_.height();
  const fs::path depth = scene_ / frameFile("depth", static_cast<int>(image.id));
  if (isFile(depth)) {
    const AnyImage units = readImage(depth, width, height);
    const auto* wide = std::get_if<Image<uint16_t>>(&units);
    if (!wide) throw InputError(depth, "must be a grey image of 16 bits");
    truth.depth_m = Image<float>(width, height);
    std::transform(wide->pixels.begin(), wide->pixels.end(), truth.depth_m.pixels.begin(),
                   [&](uint16_t u) { return static_cast<float>(kMetres * image.depth_scale * u); });
  }
  for (size_t n = 0; n < image.annotations.size(); ++n) {
    const fs::path mask = scene_ / maskFile("mask", static_cast<int>(image.id),
                                            static_cast<size_t>(image.annotations[n].index));
    if (!isFile(mask)) continue;
    AnyImage read = readImage(mask, width, height);
    if (!std::holds_alternative<Image<uint8_t>>(read))
      throw InputError(mask, "must be a grey image of 8 bits");
    truth.objects[n].mask = std::get<Image<uint8_t>>(std::move(read));
  }
}

FrameAndTruth BopReader::read(int index) {
  DIORAMA_CHECK(0 <= index && index < frameCount());
  const BopImage& image = images_[static_cast<size_t>(index)];
  FrameAndTruth result;
  result.frame = readFrame(imageFile({"rgb", "gray"}, image.id), camera_);
  result.frame.index = index;
  result.frame.timestamp_ns = image.timestamp_ns;
  result.truth = readTruth(image);
  return result;
}

}  // namespace diorama
