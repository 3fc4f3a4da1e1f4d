#include "sim/scene_rays.h"

namespace diorama {
namespace {

void setLane(simd::Vector8& vectors, int lane, const Vector3d& v) {
  vectors.x[lane] = static_cast<float>(v.x());
  vectors.y[lane] = static_cast<float>(v.y());
  vectors.z[lane] = static_cast<float>(v.z());
}

// Takes the hits that are nearer than those so far. `T_world_part` of a row: the frame of the
// part's triangles.
template <class Pose>
void takeNearer(const RenderScene& part, const TimedRays& rays, int active,
                const Pose& T_world_part, SceneHits& nearest) {
  RayPacket packet{simd::splat3(0, 0, 0), simd::splat3(0, 0, 1)};
  std::array<SE3, kRaysTogether> poses;
  for (int lane = 0; lane < kRaysTogether; ++lane) {
    if (!(active >> lane & 1)) continue;
    const TimedRay& ray = rays[static_cast<size_t>(lane)];
    const SE3& T = poses[static_cast<size_t>(lane)] = T_world_part(ray.row);
    setLane(packet.origin, lane, T.inverse() * ray.origin);
    setLane(packet.direction, lane, T.rotation.conjugate() * ray.direction);
  }
  const PacketHits hits =
      part.bvh->closest(packet, simd::maskOfBits(active), simd::splat(0.f), true);
  for (int lane = 0; lane < kRaysTogether; ++lane) {
    SceneHit& best = nearest[static_cast<size_t>(lane)];
    if (!hits.mask[lane] || (best.t > 0 && best.t <= hits.t[lane])) continue;
    const Vector3d normal(static_cast<double>(hits.normal.x[lane]),
                          static_cast<double>(hits.normal.y[lane]),
                          static_cast<double>(hits.normal.z[lane]));
    best = {hits.t[lane], part.triangles[static_cast<size_t>(hits.triangle[lane])].instance,
            poses[static_cast<size_t>(lane)].rotation * normal};
  }
}

}  // namespace

SceneHits closestHits(const RenderScene& scene, const FrameGeometry& frame, const TimedRays& rays,
                      int active) {
  SceneHits nearest;
  takeNearer(
      scene, rays, active, [](double) { return SE3{}; }, nearest);
  for (const MovingObject& moving : scene.moving)
    takeNearer(
        *moving.scene, rays, active,
        [&](double row) {
          return frame.T_world_instance(static_cast<int>(moving.object) + 1, row);
        },
        nearest);
  return nearest;
}

}  // namespace diorama
