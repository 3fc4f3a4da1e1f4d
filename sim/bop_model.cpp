#include "sim/bop_model.h"

#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace diorama {
namespace {

// The texture of all triangles; empty when there is none, or more than one.
std::filesystem::path commonTexture(const Mesh& mesh) {
  if (mesh.uvs.empty() || mesh.triangle_materials.empty()) return {};
  const auto texture = [&](int m) { return mesh.materials[static_cast<size_t>(m)].texture; };
  const std::filesystem::path first = texture(mesh.triangle_materials.front());
  const bool all = std::all_of(mesh.triangle_materials.begin(), mesh.triangle_materials.end(),
                               [&](int m) { return texture(m) == first; });
  return all ? first : std::filesystem::path{};
}

// To a nanometre, or a millionth.
std::string rounded(double value) { return formatNumber(std::round(1e6 * value) / 1e6); }

// Linear to sRGB (IEC 61966-2-1), 8 bits.
int srgb(float linear) {
  const double v = std::clamp(static_cast<double>(linear), 0.0, 1.0);
  const double s = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * s));
}

std::vector<Vector3f> vertexColors(const Mesh& mesh) {
  std::vector<Vector3f> colors(mesh.positions.size(), Material{}.diffuse);
  for (size_t t = 0; t < mesh.triangle_materials.size(); ++t)
    for (int corner : {0, 1, 2})
      colors[static_cast<size_t>(mesh.triangles[t][corner])] =
          mesh.materials[static_cast<size_t>(mesh.triangle_materials[t])].diffuse;
  return colors;
}

std::string header(const Mesh& mesh, const std::string& texture) {
  std::string text = "ply\nformat ascii 1.0\n";
  if (!texture.empty()) text += "comment TextureFile " + texture + "\n";
  text += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
  std::vector<std::string> columns = {"x", "y", "z"};
  if (!mesh.normals.empty()) columns.insert(columns.end(), {"nx", "ny", "nz"});
  if (!texture.empty()) columns.insert(columns.end(), {"texture_u", "texture_v"});
  for (const std::string& column : columns) text += "property float " + column + "\n";
  for (const char* column : {"red", "green", "blue"})
    text += std::string("property uchar ") + column + "\n";
  return text + "element face " + std::to_string(mesh.triangles.size()) +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

}  // namespace

void writeBopModel(const Mesh& mesh, const std::string& name, SequenceFiles& files) {
  const std::filesystem::path image = commonTexture(mesh);
  std::string texture;
  if (!image.empty()) {
    texture = std::filesystem::path(name).filename().string() + image.extension().string();
    files.write(name + image.extension().string(), readFile(image));
  }
  const std::vector<Vector3f> colors = vertexColors(mesh);
  std::string text = header(mesh, texture);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto add = [&](double v) { text += " " + rounded(v); };
    const Vector3d p = 1000 * mesh.positions[i].cast<double>();
    text += rounded(p.x()) + " " + rounded(p.y()) + " " + rounded(p.z());
    if (!mesh.normals.empty())
      for (int axis : {0, 1, 2}) add(static_cast<double>(mesh.normals[i][axis]));
    if (!texture.empty())
      for (int axis : {0, 1}) add(static_cast<double>(mesh.uvs[i][axis]));
    for (int channel : {0, 1, 2}) text += " " + std::to_string(srgb(colors[i][channel]));
    text += "\n";
  }
  for (const Eigen::Vector3i& t : mesh.triangles)
    text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) +
            "\n";
  files.write(name + ".ply", text);
}

}  // namespace diorama
