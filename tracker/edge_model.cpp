#include "tracker/edge_model.h"

#include <algorithm>
#include <numbers>
#include <tuple>
#include <utility>

#include "tracker/view_sphere.h"

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

// The farthest vertices in directions all around.
std::vector<Vector3d> outermostVertices(const std::vector<Vector3d>& vertices) {
  constexpr int kDirections = 64;
  std::vector<Vector3d> out;
  for (const Vector3d& direction : sphereDirections(kDirections)) {
    const Vector3d* farthest = &vertices[0];
    for (const Vector3d& v : vertices)
      if (v.dot(direction) > farthest->dot(direction)) farthest = &v;
    if (std::find(out.begin(), out.end(), *farthest) == out.end()) out.push_back(*farthest);
  }
  return out;
}

}  // namespace

void FacePlanes::add(const Vector3d& normal, const Vector3d& p) {
  const Vector3f n = normal.cast<float>();
  nx.push_back(n.x());
  ny.push_back(n.y());
  nz.push_back(n.z());
  d.push_back(static_cast<float>(normal.dot(p)));
}

void findContour(const EdgeModel& model, const Vector3d& eye, std::vector<uint8_t>& contour) {
  const size_t count = model.edges.size();
  contour.resize(count);
  const auto [x, y, z] = std::tuple(static_cast<float>(eye.x()), static_cast<float>(eye.y()),
                                    static_cast<float>(eye.z()));
  const auto above = [&](const FacePlanes& planes, size_t i) {
    return planes.nx[i] * x + planes.ny[i] * y + planes.nz[i] * z - planes.d[i];
  };
  for (size_t i = 0; i < count; ++i)
    contour[i] = above(model.first_planes, i) * above(model.second_planes, i) <= 0;
  for (const int i : model.boundary_edges) contour[static_cast<size_t>(i)] = 1;
}

ProjectedBox projectedBox(const EdgeModel& model, const Camera& camera, const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  ProjectedBox box{Vector2d::Constant(1e9), Vector2d::Constant(-1e9)};
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
  MeshEdges found = findMeshEdges(mesh, {.sharp_cosine = options.sharp_edge_cosine,
                                         .rounded_cosine = options.rounded_edge_cosine,
                                         .flat_cosine = options.flat_edge_cosine,
                                         .weld_tolerance = options.weld_tolerance});
  model.centre_object = found.centre_object;
  model.diameter = mesh.diameter();
  if (!(model.diameter > 0)) return model;
  model.sample_spacing = model.diameter / options.samples_per_diameter;
  model.vertices = std::move(found.vertices);
  model.outermost = outermostVertices(model.vertices);
  for (const MeshEdge& edge : found.edges) {
    const Vector3d& p = model.vertices[static_cast<size_t>(edge.a)];
    model.first_planes.add(edge.n1, p);
    model.second_planes.add(edge.n2, p);
    const int index = static_cast<int>(model.edges.size());
    if (edge.kind == EdgeKind::kBoundary) model.boundary_edges.push_back(index);
    if (edge.kind == EdgeKind::kSharp) model.sharp_edges.push_back(index);
    model.edges.push_back({edge});
    addSamples(model, model.edges.size() - 1);
  }
  return model;
}

double pixelMotion(const EdgeModel& model, const Camera& camera, const SE3& a, const SE3& b) {
  const double moved = (a.translation - b.translation).norm();
  const double turned = std::numbers::sqrt2 * angleBetween(a.rotation, b.rotation);
  return camera.fx() / a.translation.z() * (moved + 0.35 * model.diameter * turned);
}

}  // namespace diorama
