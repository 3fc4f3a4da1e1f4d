#include "app/run_journal.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/text.h"
#include "eval/csv.h"
#include "eval/mesh_preview.h"
#include "eval/pose_errors.h"

namespace diorama {
namespace {

std::string field(const std::optional<double>& value) { return value ? formatNumber(*value) : ""; }

nlohmann::ordered_json meshJson(const Mesh& mesh) {
  nlohmann::ordered_json vertices = nlohmann::ordered_json::array(), triangles = vertices;
  for (const Vector3f& p : mesh.positions)
    for (int k = 0; k < 3; ++k) vertices.push_back(std::round(1e4 * double(p[k])) / 1e4);
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) triangles.push_back(t[k]);
  return {{"vertices", vertices}, {"triangles", triangles}};
}

}  // namespace

RunJournal::RunJournal(std::vector<ObjectModel> models)
    : models_(std::move(models)),
      objects_(models_.size()),
      errors_("frame,timestamp,object,held,err_m,err_rad,visible_fraction\n"),
      timing_("frame,timestamp,odometry_ms,tracker_ms,mapper_ms\n") {}

void RunJournal::add(int number, int64_t timestamp_ns, const FrameResult& result,
                     const std::optional<GroundTruth>& truth) {
  const std::vector<std::string> place = {std::to_string(number), formatSeconds(timestamp_ns)};
  timing_ += csvLine({place[0], place[1], formatFixed(result.odometry_ms, 3),
                      formatFixed(result.tracker_ms, 3), formatFixed(result.mapper_ms, 3)});
  if (truth) camera_.poses.push_back({timestamp_ns, truth->T_world_camera});
  for (size_t i = 0; i < models_.size(); ++i) {
    std::optional<SE3> T_camera_object;
    std::optional<double> visible, error_m, error_rad;
    if (truth)
      for (const ObjectTruth& object : truth->objects)
        if (object.name == models_[i].name) {
          T_camera_object = truth->T_world_camera.inverse() * object.T_world_object;
          visible = object.visibleFraction();
        }
    const ObjectResult& object = result.objects[i];
    if (T_camera_object) {
      objects_[i].poses.push_back({timestamp_ns, *T_camera_object});
      if (const std::optional<SE3>& pose = object.T_camera_object) {
        const PoseError error =
            poseError(*pose, nearestSymmetricPose(*pose, *T_camera_object, models_[i].symmetries));
        error_m = error.translation_m;
        error_rad = error.rotation_rad;
      }
    }
    const bool held = object.measurement ? object.measurement->claimed : false;
    errors_ +=
        csvLine({place[0], place[1], models_[i].name, object.measurement ? (held ? "1" : "0") : "",
                 field(error_m), field(error_rad), field(visible)});
  }
}

std::string RunJournal::modelsJson() const {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const ObjectModel& model : models_) json[model.name] = meshJson(previewMesh(model.mesh));
  return json.dump() + "\n";
}

void RunJournal::write(const std::filesystem::path& folder) const {
  writeFileAtomically(folder / "errors.csv", errors_);
  writeFileAtomically(folder / "timing.csv", timing_);
  writeFileAtomically(folder / "models.json", modelsJson());
  if (!camera_.poses.empty()) {
    createFolder(folder / "truth");
    writeFileAtomically(folder / "truth/camera.txt", toTum(camera_));
  }
  for (size_t i = 0; i < models_.size(); ++i) {
    if (objects_[i].poses.empty()) continue;
    createFolder(folder / "truth/objects");
    writeFileAtomically(folder / "truth/objects" / (models_[i].name + ".txt"), toTum(objects_[i]));
  }
}

}  // namespace diorama
