#include "tracker/edge_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace diorama {
namespace {

void addSamples(EdgeModel& model, size_t edge_index) {
  ModelEdge& edge = model.edges[edge_index];
  const Vector3d a = model.vertices[static_cast<size_t>(edge.a)];
  const Vector3d along = model.vertices[static_cast<size_t>(edge.b)] - a;
  edge.first_sample = static_cast<int>(model.samples.size());
  edge.sample_count = std::max(1, static_cast<int>(along.norm() / model.sample_spacing));
  for (int k = 0; k < edge.sample_count; ++k)
    model.samples.push_back({a + along * ((k + 0.5) / edge.sample_count), along.normalized(),
                             static_cast<int>(edge_index)});
}

// The farthest vertices in directions spread evenly over the sphere (a Fibonacci lattice).
std::vector<Vector3d> outermostVertices(const std::vector<Vector3d>& vertices) {
  constexpr int kDirections = 64;
  std::vector<Vector3d> out;
  for (int i = 0; i < kDirections; ++i) {
    const double z = (2 * i + 1.0) / kDirections - 1, r = std::sqrt(1 - z * z);
    const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
    const Vector3d direction(r * std::cos(angle), r * std::sin(angle), z);
    const Vector3d* farthest = &vertices[0];
    for (const Vector3d& v : vertices)
      if (v.dot(direction) > farthest->dot(direction)) farthest = &v;
    if (std::find(out.begin(), out.end(), *farthest) == out.end()) out.push_back(*farthest);
  }
  return out;
}

}  // namespace

PixelBox projectedBox(const EdgeModel& model, const Camera& camera, const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  PixelBox box{Vector2d::Constant(1e9), Vector2d::Constant(-1e9)};
  for (const Vector3d& v : model.outermost)
    if (const auto u = camera.project(R * v + T.translation)) {
      box.low = box.low.cwiseMin(*u);
      box.high = box.high.cwiseMax(*u);
    }
  return box;
}

EdgeModel makeEdgeModel(const Mesh& mesh, const TrackerOptions& options) {
  EdgeModel model;
  if (mesh.positions.empty()) return model;
  MeshEdges found = findMeshEdges(
      mesh, {options.sharp_edge_cosine, options.flat_edge_cosine, options.weld_tolerance});
  model.centre_object = found.centre_object;
  model.diameter = mesh.diameter();
  if (!(model.diameter > 0)) return model;
  model.sample_spacing = model.diameter / options.samples_per_diameter;
  model.vertices = std::move(found.vertices);
  model.outermost = outermostVertices(model.vertices);
  for (const MeshEdge& edge : found.edges) {
    model.edges.push_back({edge});
    addSamples(model, model.edges.size() - 1);
  }
  return model;
}

}  // namespace diorama
