#include "sim/truth_tracer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "sim/scene_rays.h"

namespace diorama {
namespace {

// What lies nearer than the point by this part of its distance hides it. Traversal in single
// precision is off by some 1e-6.
constexpr double kNearer = 1 - 1e-4;

}  // namespace

TruthTracer::TruthTracer(std::shared_ptr<const RenderScene> scene, const Camera& camera)
    : scene_(std::move(scene)), rays_(camera.width(), camera.height()) {
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) rays_(x, y) = camera.unproject(Vector2d(x, y));
}

Image<Normal> TruthTracer::normals(const FrameGeometry& frame, const GroundTruth& truth,
                                   WorkerPool& pool) const {
  Image<Normal> normals(rays_.width, rays_.height);
  pool.run(normals.height, [&](int y) {
    for (int x = 0; x < normals.width; x += kRaysTogether)
      normalsOfPixels(frame, truth, x, y, normals);
  });
  return normals;
}

// Eight pixels of a row, so that their rays can be traced together. A ray that grazes an outline
// may pass it on the other side than the one that gave the depth: then one beside it is taken.
void TruthTracer::normalsOfPixels(const FrameGeometry& frame, const GroundTruth& truth, int x0,
                                  int y, Image<Normal>& normals) const {
  constexpr double kBeside = 2e-6;  // some 1/1000 px
  constexpr std::array<std::array<double, 2>, 5> kTries = {
      {{0, 0}, {kBeside, 0}, {-kBeside, 0}, {0, kBeside}, {0, -kBeside}}};
  const SE3 T_world_camera = frame.T_world_camera(y);
  int pending = 0;
  for (int lane = 0; lane < std::min(kRaysTogether, normals.width - x0); ++lane)
    pending |= (truth.depth_m(x0 + lane, y) > 0) << lane;
  for (size_t k = 0; k < kTries.size() && pending != 0; ++k) {
    TimedRays rays;
    for (int lane = 0; lane < kRaysTogether; ++lane)
      if (pending >> lane & 1)
        rays[static_cast<size_t>(lane)] = {
            T_world_camera.translation,
            T_world_camera.rotation *
                (*rays_(x0 + lane, y) + Vector3d(kTries[k][0], kTries[k][1], 0)),
            static_cast<double>(y)};
    const SceneHits hits = closestHits(*scene_, frame, rays, pending);
    for (int lane = 0; lane < kRaysTogether; ++lane) {
      const SceneHit& hit = hits[static_cast<size_t>(lane)];
      const int x = x0 + lane;
      if (!(pending >> lane & 1) || hit.instance != truth.instance_id(x, y) ||
          std::abs(hit.t - truth.depth_m(x, y)) > 1e-3f * hit.t)
        continue;
      const Vector3d n = T_world_camera.rotation.conjugate() * hit.normal.normalized();
      const double side = n.dot(*rays_(x, y)) > 0 ? -1 : 1;
      normals(x, y) = {static_cast<float>(side * n.x()), static_cast<float>(side * n.y()),
                       static_cast<float>(side * n.z())};
      pending &= ~(1 << lane);
    }
  }
}

FlowField TruthTracer::flow(const FrameGeometry& from, const FrameGeometry& to,
                            const GroundTruth& truth, WorkerPool& pool) const {
  FlowField field;
  field.flow_px = Image<FlowVector>(rays_.width, rays_.height);
  field.state = Image<FlowState>(rays_.width, rays_.height, FlowState::kNoSurface);
  pool.run(rays_.height, [&](int y) {
    for (int x = 0; x < rays_.width; x += kRaysTogether) flowOfPixels(from, to, truth, x, y, field);
  });
  return field;
}

void TruthTracer::flowOfPixels(const FrameGeometry& from, const FrameGeometry& to,
                               const GroundTruth& truth, int x0, int y, FlowField& field) const {
  const SE3 T_world_camera = from.T_world_camera(y);
  TimedRays rays;  // of the other frame, through the points
  std::array<double, kRaysTogether> depth_m{};
  int active = 0;
  for (int lane = 0; lane < std::min(kRaysTogether, rays_.width - x0); ++lane) {
    const int x = x0 + lane;
    const double z = static_cast<double>(truth.depth_m(x, y));
    if (z == 0) continue;
    const int instance = truth.instance_id(x, y);
    const Vector3d p_world = T_world_camera * (z * *rays_(x, y));
    const auto imaged =
        to.project(instance, from.T_world_instance(instance, y).inverse() * p_world);
    field.state(x, y) = FlowState::kOutside;
    if (!imaged) continue;
    field.flow_px(x, y) = {static_cast<float>(imaged->u_px.x() - x),
                           static_cast<float>(imaged->u_px.y() - y)};
    if (!to.camera().contains(imaged->u_px)) continue;
    const SE3 T_world_other = to.T_world_camera(imaged->row);
    depth_m[static_cast<size_t>(lane)] = imaged->p_camera.z();
    rays[static_cast<size_t>(lane)] = {
        T_world_other.translation,
        T_world_other.rotation * (imaged->p_camera / imaged->p_camera.z()), imaged->row};
    active |= 1 << lane;
  }
  if (active == 0) return;
  const SceneHits hits = closestHits(*scene_, to, rays, active);
  for (size_t lane = 0; lane < kRaysTogether; ++lane) {
    if (!(active >> lane & 1)) continue;
    const int x = x0 + static_cast<int>(lane);
    const SceneHit& hit = hits[lane];
    const bool hidden = hit.t > 0 && static_cast<double>(hit.t) < kNearer * depth_m[lane];
    field.state(x, y) = !hidden                                   ? FlowState::kVisible
                        : hit.instance == truth.instance_id(x, y) ? FlowState::kHiddenBySelf
                                                                  : FlowState::kHiddenByOther;
  }
}

}  // namespace diorama
