#include "sim/bop_writer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "core/text.h"
#include "sim/bop_model.h"
#include "sim/mesh_import.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kMillimetres = 1000;  // per metre
const std::string kRoot = "bop/";
const std::string kScene = "bop/test/000000/";

std::string list(const std::vector<double>& numbers) {
  std::string text = "[";
  for (size_t i = 0; i < numbers.size(); ++i) text += (i ? ", " : "") + formatNumber(numbers[i]);
  return text + "]";
}

// Row by row.
std::string rotation(const SE3& pose) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = pose.rotationMatrix();
  return list({R.data(), R.data() + 9});
}

std::string translation_mm(const SE3& pose) {
  const Vector3d t = kMillimetres * pose.translation;
  return list({t.x(), t.y(), t.z()});
}

std::string distortion(const CameraParameters& camera) {
  if (camera.distortion.empty() && camera.model != CameraModel::kFisheye) return "";
  return ", \"distortion_model\": \"" + toString(camera.model) +
         "\", \"distortion_coefficients\": " + list(camera.distortion);
}

std::string depthScale() { return formatNumber(kMillimetres / kDepthUnitsPerMetre); }

std::string cameraJson(const CameraParameters& c) {
  return "{\"cx\": " + formatNumber(c.cx) + ", \"cy\": " + formatNumber(c.cy) +
         ", \"depth_scale\": " + depthScale() + ", \"fx\": " + formatNumber(c.fx) +
         ", \"fy\": " + formatNumber(c.fy) + ", \"height\": " + std::to_string(c.height) +
         ", \"width\": " + std::to_string(c.width) + distortion(c) + "}\n";
}

std::string sceneCamera(const CameraParameters& c, const GroundTruth& truth) {
  const SE3 T_camera_world = truth.T_world_camera.inverse();
  return "{\"cam_K\": " + list({c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}) +
         ", \"depth_scale\": " + depthScale() + ", \"cam_R_w2c\": " + rotation(T_camera_world) +
         ", \"cam_t_w2c\": " + translation_mm(T_camera_world) +
         ", \"timestamp_ns\": " + std::to_string(truth.timestamp_ns) + distortion(c) + "}";
}

// As the toolkit has it: the width of a box is the distance between its outer pixels' centres.
std::string box(const PixelBox& b) {
  if (b.empty()) return "[-1, -1, -1, -1]";
  return "[" + std::to_string(b.x0) + ", " + std::to_string(b.y0) + ", " +
         std::to_string(b.x1 - b.x0) + ", " + std::to_string(b.y1 - b.y0) + "]";
}

std::string groundTruthInfo(const ObjectTruth& object, const ObjectPixels& pixels) {
  const bool visible = object.px_visible > 0;
  return "{\"px_count_all\": " + std::to_string(object.px_all) +
         ", \"px_count_valid\": " + std::to_string(pixels.with_depth) +
         ", \"px_count_visib\": " + std::to_string(object.px_visible) +
         ", \"visib_fract\": " + formatNumber(object.visibleFraction().value_or(0)) +
         ", \"bbox_obj\": " + box(visible ? pixels.whole : PixelBox{}) +
         ", \"bbox_visib\": " + box(visible ? pixels.visible : PixelBox{}) + "}";
}

std::string groundTruth(const SE3& T_camera_object, int obj_id) {
  return "{\"cam_R_m2c\": " + rotation(T_camera_object) +
         ", \"cam_t_m2c\": " + translation_mm(T_camera_object) +
         ", \"obj_id\": " + std::to_string(obj_id) + "}";
}

// obj_id from 1 on, one per tracked object; the same for the same model.
std::vector<int> objectIds(const Scene& scene) {
  std::map<std::tuple<fs::path, double, bool>, int> known;
  std::vector<int> ids;
  for (size_t i : trackedObjects(scene)) {
    const SceneObject& object = scene.objects[i];
    const int next = static_cast<int>(known.size()) + 1;
    ids.push_back(
        known.emplace(std::tuple(object.mesh, object.scale, object.y_up), next).first->second);
  }
  return ids;
}

std::string symmetriesJson(const Symmetries& symmetries) {
  std::string text;
  if (!symmetries.discrete.empty()) {
    text += ", \"symmetries_discrete\": [";
    for (size_t i = 0; i < symmetries.discrete.size(); ++i) {
      SE3 T = symmetries.discrete[i];
      T.translation *= kMillimetres;
      const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T.matrix();
      text += (i ? ", " : "") + list({m.data(), m.data() + 16});
    }
    text += "]";
  }
  if (const auto& axis = symmetries.axis)
    text += ", \"symmetries_continuous\": [{\"axis\": " + list({axis->x(), axis->y(), axis->z()}) +
            ", \"offset\": [0, 0, 0]}]";
  return text;
}

std::string modelInfo(const SceneObject& object, const Mesh& mesh) {
  const Vector3d least = kMillimetres * mesh.minCorner().cast<double>(),
                 size = kMillimetres * mesh.maxCorner().cast<double>() - least;
  std::string text =
      "{\"diameter\": " + formatNumber(kMillimetres * largestDistance(mesh.positions));
  for (int axis = 0; axis < 3; ++axis)
    text += ", \"min_" + std::string(1, "xyz"[axis]) + "\": " + formatNumber(least[axis]) +
            ", \"size_" + std::string(1, "xyz"[axis]) + "\": " + formatNumber(size[axis]);
  return text + ", \"name\": \"" + object.name + "\"" + symmetriesJson(object.symmetries) + "}";
}

void writeModels(const Scene& scene, SequenceFiles& files) {
  const std::vector<size_t> tracked = trackedObjects(scene);
  const std::vector<int> ids = objectIds(scene);
  std::string info;
  int written = 0;
  for (size_t n = 0; n < tracked.size(); ++n) {
    if (ids[n] <= written) continue;
    written = ids[n];
    const SceneObject& object = scene.objects[tracked[n]];
    const Mesh mesh = importMesh(object.mesh, {object.scale, object.y_up});
    writeBopModel(mesh, kRoot + "models/obj_" + sixDigits(static_cast<size_t>(written)), files);
    info += (info.empty() ? "\n  \"" : ",\n  \"") + std::to_string(written) +
            "\": " + modelInfo(object, mesh);
  }
  files.write(kRoot + "models/models_info.json", "{" + info + "\n}\n");
}

}  // namespace

// Points in the order of their distance r from the middle: no pair is further apart than the sum
// of the two distances, so that few pairs are left to measure.
double largestDistance(const std::vector<Vector3f>& points) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3f& p : points) middle += p.cast<double>() / static_cast<double>(points.size());
  std::vector<std::pair<double, Vector3d>> sorted;
  for (const Vector3f& p : points)
    sorted.emplace_back((p.cast<double>() - middle).norm(), p.cast<double>());
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first > b.first; });
  double largest = 0;
  for (size_t i = 0; i < sorted.size() && 2 * sorted[i].first > largest; ++i)
    for (size_t j = i + 1; j < sorted.size() && sorted[i].first + sorted[j].first > largest; ++j)
      largest = std::max(largest, (sorted[i].second - sorted[j].second).norm());
  return largest;
}

void writeBopFrame(const EncodedFrame& frame, SequenceFiles& files) {
  const auto write = [&](const std::string& name, const std::string& png) {
    if (!png.empty()) files.write(kScene + name, png);
  };
  write(frameFile("rgb", frame.number), frame.picture);
  write(frameFile("depth", frame.number), frame.depth);
  for (size_t n = 0; n < frame.objects.size(); ++n) {
    write(maskFile("mask", frame.number, n), frame.objects[n].mask);
    write(maskFile("mask_visib", frame.number, n), frame.objects[n].mask_visib);
  }
}

void writeBopTexts(const Scene& scene, const std::vector<FrameRecord>& records, int first_frame,
                   SequenceFiles& files) {
  const std::vector<int> ids = objectIds(scene);
  std::string camera, poses, info, targets;
  int number = first_frame;
  for (const FrameRecord& record : records) {
    const std::string key =
        std::string(number == first_frame ? "" : ",") + "\n  \"" + std::to_string(number) + "\": ";
    camera += key + sceneCamera(scene.camera, record.truth);
    std::string frame_poses, frame_info;
    const SE3 T_camera_world = record.truth.T_world_camera.inverse();
    std::map<int, int> instances;
    for (size_t n = 0; n < ids.size(); ++n) {
      const ObjectTruth& object = record.truth.objects[n];
      frame_poses += (n ? ", " : "") + groundTruth(T_camera_world * object.T_world_object, ids[n]);
      frame_info += (n ? ", " : "") + groundTruthInfo(object, record.pixels[n]);
      ++instances[ids[n]];
    }
    poses += key + "[" + frame_poses + "]";
    info += key + "[" + frame_info + "]";
    for (const auto& [id, count] : instances)
      targets += std::string(targets.empty() ? "" : ",") +
                 "\n  {\"im_id\": " + std::to_string(number) +
                 ", \"inst_count\": " + std::to_string(count) +
                 ", \"obj_id\": " + std::to_string(id) + ", \"scene_id\": 0}";
    ++number;
  }
  files.write(kScene + "scene_camera.json", "{" + camera + "\n}\n");
  files.write(kScene + "scene_gt.json", "{" + poses + "\n}\n");
  files.write(kScene + "scene_gt_info.json", "{" + info + "\n}\n");
  files.write(kRoot + "test_targets_bop19.json", "[" + targets + "\n]\n");
  files.write(kRoot + "camera.json", cameraJson(scene.camera));
  writeModels(scene, files);
}

}  // namespace diorama
