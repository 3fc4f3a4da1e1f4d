#include "sim/visible_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "sim/mesh_import.h"
#include "sim/scene_rays.h"

namespace diorama {
namespace {

// What lies nearer than the edge by this part of its distance hides it; its own faces do not.
constexpr double kNearer = 1 - 1e-4;
constexpr double kSample_px = 1;  // visibility is decided so often along the edge
constexpr double kVertex_px = 4;  // vertices of the polyline: the lens bends edges but slightly
constexpr double kCut_px = 1e-3;  // ends of hidden parts
constexpr double kShortest_px = 0.25;  // of a visible part: less is a graze
constexpr int kMostSamples = 4096;     // of an edge; also where it reaches behind the camera

}  // namespace

EdgeTracer::EdgeTracer(const Scene& scene, std::shared_ptr<const RenderScene> render_scene)
    : render_scene_(std::move(render_scene)) {
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    if (!object.tracked) continue;
    Model model;
    model.object = static_cast<int>(models_.size());
    model.instance = static_cast<int>(i) + 1;
    model.mesh = findMeshEdges(importMesh(object.mesh, {object.scale, object.y_up}));
    models_.push_back(std::move(model));
  }
}

std::vector<VisibleEdge> EdgeTracer::visible(const FrameGeometry& frame, WorkerPool& pool) const {
  std::vector<VisibleEdge> all;
  for (const Model& model : models_) {
    constexpr size_t kTogether = 64;
    const size_t count = model.mesh.edges.size(), jobs = (count + kTogether - 1) / kTogether;
    std::vector<std::vector<VisibleEdge>> parts(jobs);
    pool.run(static_cast<int>(jobs), [&](int job) {
      const auto j = static_cast<size_t>(job);
      for (size_t e = j * kTogether; e < std::min(count, (j + 1) * kTogether); ++e)
        addVisible(model, e, frame, parts[j]);
    });
    for (std::vector<VisibleEdge>& part : parts)
      std::move(part.begin(), part.end(), std::back_inserter(all));
  }
  return all;
}

// An edge as seen in a frame; s in [0, 1] runs from vertex a to vertex b.
class EdgeTracer::Line {
 public:
  Line(const RenderScene& scene, const FrameGeometry& frame, const Model& model,
       const MeshEdge& edge)
      : scene_(scene),
        frame_(frame),
        instance_(model.instance),
        a_(model.mesh.centre_object + model.mesh.vertices[static_cast<size_t>(edge.a)]),
        b_(model.mesh.centre_object + model.mesh.vertices[static_cast<size_t>(edge.b)]) {}

  std::optional<ImagedPoint> at(double s) const {
    return frame_.project(instance_, a_ + s * (b_ - a_));
  }
  // The pixel, where the point at s is seen.
  using Seen = std::optional<Vector2d>;
  Seen seen(double s) const { return seen(&s, 1)[0]; }
  std::array<Seen, kRaysTogether> seen(const double* s, size_t count) const {
    TimedRays rays;
    std::array<Seen, kRaysTogether> result;
    std::array<double, kRaysTogether> depth_m{};
    int active = 0;
    for (size_t k = 0; k < count; ++k) {
      const auto imaged = at(s[k]);
      if (!imaged || !frame_.camera().contains(imaged->u_px)) continue;
      const SE3 T_world_camera = frame_.T_world_camera(imaged->row);
      result[k] = imaged->u_px;
      depth_m[k] = imaged->p_camera.z();
      rays[k] = {T_world_camera.translation,
                 T_world_camera.rotation * (imaged->p_camera / depth_m[k]), imaged->row};
      active |= 1 << k;
    }
    if (active == 0) return result;
    const SceneHits hits = closestHits(scene_, frame_, rays, active);
    for (size_t k = 0; k < count; ++k)
      if (hits[k].t > 0 && static_cast<double>(hits[k].t) < kNearer * depth_m[k]) result[k].reset();
    return result;
  }
  // The pixel of the last seen place between `in`, which is seen at u_px, and `out`, which is not.
  Vector2d cut(double in, double out, Vector2d u_px, double precision) const {
    while (std::abs(out - in) > precision) {
      const double middle = (in + out) / 2;
      const Seen there = seen(middle);
      (there ? in : out) = middle;
      if (there) u_px = *there;
    }
    return u_px;
  }
  bool onSilhouette(const MeshEdge& edge) const {
    const auto imaged = at(0.5);
    const double row = imaged ? imaged->row : (frame_.camera().height() - 1) / 2.0;
    const Vector3d camera =
        frame_.T_world_instance(instance_, row).inverse() * frame_.T_world_camera(row).translation;
    const Vector3d view = (a_ + b_) / 2 - camera;
    return edge.n1.dot(view) * edge.n2.dot(view) <= 0;
  }
  // So many that they lie a pixel apart; none when the edge is out of sight.
  int sampleCount() const {
    const auto a = at(0), b = at(1);
    if (!a && !b) return 0;
    if (!a || !b) return kMostSamples;
    const double length = (a->u_px - b->u_px).norm() / kSample_px;
    return std::clamp(static_cast<int>(std::ceil(length)), 1, kMostSamples);
  }

 private:
  const RenderScene& scene_;
  const FrameGeometry& frame_;
  int instance_;
  Vector3d a_, b_;  // m, object frame
};

void EdgeTracer::addVisible(const Model& model, size_t index, const FrameGeometry& frame,
                            std::vector<VisibleEdge>& out) const {
  const MeshEdge& edge = model.mesh.edges[index];
  const Line line(*render_scene_, frame, model, edge);
  if (edge.kind == EdgeKind::kSmooth && !line.onSilhouette(edge)) return;
  const int count = line.sampleCount();
  if (count == 0) return;
  std::vector<Line::Seen> seen;
  for (int first = 0; first <= count; first += kRaysTogether) {
    std::array<double, kRaysTogether> s{};
    const int together = std::min(kRaysTogether, count + 1 - first);
    for (int k = 0; k < together; ++k)
      s[static_cast<size_t>(k)] = static_cast<double>(first + k) / count;
    const auto part = line.seen(s.data(), static_cast<size_t>(together));
    seen.insert(seen.end(), part.begin(), part.begin() + together);
  }
  const double precision = kCut_px / kSample_px / count;
  const auto place = [&](size_t i) { return static_cast<double>(i) / count; };
  const size_t step = static_cast<size_t>(kVertex_px / kSample_px);
  for (size_t i = 0, end; i < seen.size(); i = end) {
    end = i + 1;
    if (!seen[i]) continue;
    while (end < seen.size() && seen[end]) ++end;
    VisibleEdge visible{model.object, static_cast<int>(index), edge.kind, {}};
    if (i > 0) visible.line_px.push_back(line.cut(place(i), place(i - 1), *seen[i], precision));
    for (size_t k = i; k < end; ++k)
      if (k == i || k + 1 == end || k % step == 0) visible.line_px.push_back(*seen[k]);
    if (end < seen.size())
      visible.line_px.push_back(line.cut(place(end - 1), place(end), *seen[end - 1], precision));
    if ((visible.line_px.front() - visible.line_px.back()).norm() >= kShortest_px)
      out.push_back(std::move(visible));
  }
}

}  // namespace diorama
