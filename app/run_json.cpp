#include "app/run_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "eval/mesh_preview.h"

namespace diorama {
namespace {

nlohmann::ordered_json rowMajor(const auto& matrix) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (int row = 0; row < matrix.rows(); ++row)
    for (int column = 0; column < matrix.cols(); ++column) list.push_back(matrix(row, column));
  return list;
}

nlohmann::ordered_json meshJson(const Mesh& mesh) {
  nlohmann::ordered_json vertices = nlohmann::ordered_json::array(), triangles = vertices;
  for (const Vector3f& p : mesh.positions)
    for (int k = 0; k < 3; ++k) vertices.push_back(std::round(1e4 * double(p[k])) / 1e4);
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) triangles.push_back(t[k]);
  return {{"vertices", vertices}, {"triangles", triangles}};
}

}  // namespace

std::string mapJson(const MapEstimate& map) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::object();
  for (const ObjectEstimate& object : map.objects)
    objects[object.name] = {{"T_world_object", rowMajor(object.T_world_object.matrix())},
                            {"covariance", rowMajor(object.covariance)}};
  return nlohmann::ordered_json{{"objects", objects}}.dump(2) + "\n";
}

std::string modelsJson(const std::vector<ObjectModel>& models) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (const ObjectModel& model : models) json[model.name] = meshJson(previewMesh(model.mesh));
  return json.dump() + "\n";
}

}  // namespace diorama
