#include "eval/mesh_preview.h"

#include <array>
#include <map>

namespace diorama {
namespace {

Mesh cluster(const Mesh& mesh, float cell_m) {
  Mesh out;
  std::map<std::array<int, 3>, int> known;
  std::vector<int> index(mesh.positions.size());
  std::vector<float> count;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vector3f& p = mesh.positions[i];
    const std::array<int, 3> cell = {static_cast<int>(std::floor(p.x() / cell_m)),
                                     static_cast<int>(std::floor(p.y() / cell_m)),
                                     static_cast<int>(std::floor(p.z() / cell_m))};
    const auto [at, is_new] = known.try_emplace(cell, static_cast<int>(out.positions.size()));
    if (is_new) {
      out.positions.emplace_back(Vector3f::Zero());
      count.push_back(0);
    }
    index[i] = at->second;
    out.positions[static_cast<size_t>(at->second)] += p;
    ++count[static_cast<size_t>(at->second)];
  }
  for (size_t i = 0; i < count.size(); ++i) out.positions[i] /= count[i];
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Eigen::Vector3i u(index[static_cast<size_t>(t[0])], index[static_cast<size_t>(t[1])],
                            index[static_cast<size_t>(t[2])]);
    if (u[0] != u[1] && u[1] != u[2] && u[2] != u[0]) out.triangles.push_back(u);
  }
  return out;
}

}  // namespace

Mesh previewMesh(const Mesh& mesh, size_t max_triangles) {
  if (mesh.positions.empty()) return {};
  // A grain of a ten thousandth joins what is one point; then coarser by steps.
  const float size = static_cast<float>(std::max(mesh.diameter(), 1e-6));
  float cell = size * 1e-4f;
  Mesh out = cluster(mesh, cell);
  while (out.triangles.size() > max_triangles) out = cluster(mesh, cell *= 1.5f);
  return out;
}

}  // namespace diorama
