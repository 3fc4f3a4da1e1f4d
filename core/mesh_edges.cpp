#include "core/mesh_edges.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

namespace diorama {
namespace {

struct Face {
  std::array<int, 3> vertices;     // welded
  const Eigen::Vector3i* corners;  // of the mesh
};

// A uniform grid with one vertex per cell: vertices within the tolerance are found in the 27 cells
// around.
class VertexWelder {
 public:
  VertexWelder(std::vector<Vector3d>& vertices, double tolerance)
      : vertices_(vertices), tolerance_(tolerance) {}

  int weld(const Vector3d& p) {
    const Vector3d cell = (p / tolerance_).array().floor();
    for (int k = 0; k < 27; ++k) {
      const Vector3d neighbour = cell + Vector3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      const auto it = grid_.find(key(neighbour));
      if (it == grid_.end()) continue;
      if ((vertices_[static_cast<size_t>(it->second)] - p).norm() <= tolerance_) return it->second;
    }
    const int id = static_cast<int>(vertices_.size());
    vertices_.push_back(p);
    grid_.emplace(key(cell), id);
    return id;
  }

 private:
  // 21 bits a coordinate: the model spans far fewer cells in each direction.
  static uint64_t key(const Vector3d& cell) {
    uint64_t out = 0;
    for (int i = 0; i < 3; ++i)
      out = out << 21 | (static_cast<uint64_t>(static_cast<int64_t>(cell[i])) & 0x1fffff);
    return out;
  }
  std::vector<Vector3d>& vertices_;
  double tolerance_;
  std::unordered_map<uint64_t, int> grid_;
};

// Faces over welded vertices; degenerate ones and repetitions (two-sided sheets) are left out.
std::vector<Face> weldFaces(const Mesh& mesh, double tolerance, MeshEdges& model) {
  VertexWelder welder(model.vertices, tolerance);
  std::vector<int> welded(mesh.positions.size());
  for (size_t i = 0; i < welded.size(); ++i)
    welded[i] = welder.weld(mesh.positions[i].cast<double>() - model.centre_object);

  using Vertices = std::array<int, 3>;
  std::vector<std::pair<Vertices, Face>> faces;  // sorted vertices first
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int i) { return welded[static_cast<size_t>(t[i])]; };
    const Vertices face{at(0), at(1), at(2)};
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) continue;
    Vertices sorted = face;
    std::sort(sorted.begin(), sorted.end());
    faces.push_back({sorted, {face, &t}});
  }
  std::sort(faces.begin(), faces.end(), [](const auto& f, const auto& g) {
    return std::tie(f.first, f.second.vertices) < std::tie(g.first, g.second.vertices);
  });
  std::vector<Face> out;
  for (size_t i = 0; i < faces.size(); ++i)
    if (i == 0 || faces[i].first != faces[i - 1].first) out.push_back(faces[i].second);
  return out;
}

// One face beside an edge.
struct Side {
  int a, b;         // the edge, a < b
  Vector3d normal;  // unit
  Vector3d inward;  // unit, in the face, perpendicular to the edge, towards the third vertex
  double width;     // of the face, that way
  Vector3f shading_a, shading_b;  // the mesh's normals at its ends; zero without any
};

std::vector<Side> sidesOf(const Mesh& mesh, const std::vector<Face>& faces, const MeshEdges& model,
                          double diameter) {
  const auto vertex = [&](int i) -> const Vector3d& {
    return model.vertices[static_cast<size_t>(i)];
  };
  const auto shading = [&](const Face& face, size_t k) -> Vector3f {
    if (mesh.normals.empty()) return Vector3f::Zero();
    return mesh.normals[static_cast<size_t>((*face.corners)[static_cast<int>(k)])];
  };
  std::vector<Side> sides;
  for (const Face& face : faces) {
    const std::array<int, 3>& f = face.vertices;
    const Vector3d n = (vertex(f[1]) - vertex(f[0])).cross(vertex(f[2]) - vertex(f[0]));
    // A sliver has no direction: its height is below a millionth of the model.
    if (n.norm() < 1e-12 * diameter * diameter) continue;
    for (size_t k = 0; k < 3; ++k) {
      size_t from = k, to = (k + 1) % 3;
      if (f[from] > f[to]) std::swap(from, to);
      const int a = f[from], b = f[to];
      const Vector3d along = (vertex(b) - vertex(a)).normalized();
      Vector3d inward = vertex(f[(k + 2) % 3]) - vertex(a);
      inward -= along * along.dot(inward);
      sides.push_back({a, b, n.normalized(), inward.normalized(), inward.norm(),
                       shading(face, from), shading(face, to)});
    }
  }
  std::stable_sort(sides.begin(), sides.end(), [](const Side& s, const Side& t) {
    return std::tie(s.a, s.b) < std::tie(t.a, t.b);
  });
  return sides;
}

// Whether the mesh is shaded as if there were no edge.
bool isShadedAcross(const Side& s, const Side& t) {
  constexpr float kAlike = 0.99f;  // cosine
  return s.shading_a.dot(t.shading_a) > kAlike && s.shading_b.dot(t.shading_b) > kAlike;
}

// Whether two faces that meet like this stand for a round surface.
bool isRound(const Side& s, const Side& t, double flatness, double diameter,
             const MeshEdgeOptions& options) {
  const double radius = std::min(s.width, t.width) / std::acos(std::clamp(flatness, -1.0, 1.0));
  return flatness > options.rounded_cosine && radius >= options.rounded_radius * diameter &&
         isShadedAcross(s, t);
}

// The edge between the given faces; nothing when it is flat. The fold is taken from the directions
// into the faces, not from the normals, since meshes with mixed winding are common.
std::optional<MeshEdge> classify(const Side* sides, size_t count, double diameter,
                                 const MeshEdgeOptions& options) {
  MeshEdge edge;
  edge.a = sides[0].a;
  edge.b = sides[0].b;
  edge.n1 = edge.n2 = sides[0].normal;
  if (count == 1) {
    edge.kind = EdgeKind::kBoundary;
    return edge;
  }
  const double flatness = -sides[0].inward.dot(sides[1].inward);  // n1 . n2 when wound alike
  edge.n2 = sides[1].normal;
  if (edge.n1.dot(edge.n2) * flatness < 0) edge.n2 = -edge.n2;
  if (count > 2 || (flatness <= options.sharp_cosine &&
                    !isRound(sides[0], sides[1], flatness, diameter, options)))
    edge.kind = EdgeKind::kSharp;
  else if (flatness < options.flat_cosine)
    edge.kind = EdgeKind::kSmooth;
  else
    return std::nullopt;
  return edge;
}

}  // namespace

MeshEdges findMeshEdges(const Mesh& mesh, const MeshEdgeOptions& options) {
  MeshEdges model;
  if (mesh.positions.empty()) return model;
  model.centre_object = (0.5f * (mesh.minCorner() + mesh.maxCorner())).cast<double>();
  const double diameter = mesh.diameter();
  if (!(diameter > 0)) return model;

  // Below 1e-6 of the model, single precision of the vertices decides.
  const double tolerance = std::max(options.weld_tolerance, 1e-6) * diameter;
  const std::vector<Side> sides = sidesOf(mesh, weldFaces(mesh, tolerance, model), model, diameter);
  for (size_t i = 0, next; i < sides.size(); i = next) {
    for (next = i + 1; next < sides.size(); ++next)
      if (sides[next].a != sides[i].a || sides[next].b != sides[i].b) break;
    if (const auto edge = classify(&sides[i], next - i, diameter, options))
      model.edges.push_back(*edge);
  }
  return model;
}

}  // namespace diorama
