#include "sim/bvh.h"

#include <embree3/rtcore.h>

#include <limits>

#include "core/errors.h"

namespace diorama {

using simd::Float8;
using simd::Int8;

struct Bvh::Handles {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  ~Handles() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
};

namespace {

RTCIntersectContext makeContext(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

// The query's members hold one number a ray; `first` is the place of a packet's first ray in them.
template <class Ray>
void fill(Ray& ray, size_t first, const RayPacket& rays, Float8 t_min, Float8 t_max) {
  const auto put = [first](auto* to, const auto& v) { std::memcpy(to + first, &v, sizeof v); };
  put(ray.org_x, rays.origin.x);
  put(ray.org_y, rays.origin.y);
  put(ray.org_z, rays.origin.z);
  put(ray.dir_x, rays.direction.x);
  put(ray.dir_y, rays.direction.y);
  put(ray.dir_z, rays.direction.z);
  put(ray.tnear, t_min);
  put(ray.tfar, t_max);
  put(ray.time, simd::splat(0.f));
  put(ray.mask, simd::splat(-1));
  put(ray.id, simd::splat(0));
  put(ray.flags, simd::splat(0));
}

template <class RayHit>
void fillHits(RayHit& query, size_t first) {
  const Int8 nothing = simd::splat(-1), zero = simd::splat(0);
  std::memcpy(query.hit.geomID + first, &nothing, sizeof nothing);
  std::memcpy(query.hit.primID + first, &zero, sizeof zero);
  std::memcpy(query.hit.instID[0] + first, &nothing, sizeof nothing);
}

template <class RayHit>
PacketHits hitsOf(const RayHit& query, size_t first, Int8 active) {
  PacketHits hits;
  hits.t = simd::load(query.ray.tfar + first);
  hits.u = simd::load(query.hit.u + first);
  hits.v = simd::load(query.hit.v + first);
  hits.normal = {simd::load(query.hit.Ng_x + first), simd::load(query.hit.Ng_y + first),
                 simd::load(query.hit.Ng_z + first)};
  Int8 geometry;
  std::memcpy(&geometry, query.hit.geomID + first, sizeof geometry);
  std::memcpy(&hits.triangle, query.hit.primID + first, sizeof hits.triangle);
  hits.mask = active & (geometry != simd::splat(-1));
  return hits;
}

const Float8 kFar = simd::splat(std::numeric_limits<float>::infinity());

}  // namespace

Bvh::Bvh(std::span<const Vector3f> corners, std::span<const uint32_t> indices, Traversal traversal)
    : handles_(std::make_unique<Handles>()) {
  // One thread: building is quick, and a user's threads stay his own.
  handles_->device = rtcNewDevice("threads=1,set_affinity=0");
  DIORAMA_CHECK(handles_->device != nullptr);
  handles_->scene = rtcNewScene(handles_->device);
  rtcSetSceneBuildQuality(handles_->scene, RTC_BUILD_QUALITY_HIGH);
  if (traversal == Traversal::kWatertight) rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);
  if (indices.empty()) {
    rtcCommitScene(handles_->scene);
    return;
  }
  RTCGeometry geometry = rtcNewGeometry(handles_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, corners.data(),
                             0, sizeof(Vector3f), corners.size());
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.data(),
                             0, 3 * sizeof(uint32_t), indices.size() / 3);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(handles_->scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(handles_->scene);
  DIORAMA_CHECK(rtcGetDeviceError(handles_->device) == RTC_ERROR_NONE);
}

Bvh::~Bvh() = default;
Bvh::Bvh(Bvh&&) noexcept = default;
Bvh& Bvh::operator=(Bvh&&) noexcept = default;

PacketHits Bvh::closest(const RayPacket& rays, Int8 active, Float8 t_min, bool coherent) const {
  alignas(32) RTCRayHit8 query;
  fill(query.ray, 0, rays, t_min, kFar);
  fillHits(query, 0);
  RTCIntersectContext context = makeContext(coherent);
  rtcIntersect8(reinterpret_cast<const int*>(&active), handles_->scene, &context, &query);
  return hitsOf(query, 0, active);
}

std::array<PacketHits, 2> Bvh::closestOfPair(const std::array<RayPacket, 2>& rays,
                                             const std::array<Int8, 2>& active) const {
  alignas(64) RTCRayHit16 query;
  alignas(64) int valid[16];
  std::memcpy(valid, active.data(), sizeof valid);
  for (size_t k = 0; k < 2; ++k) {
    fill(query.ray, 8 * k, rays[k], simd::splat(0.f), kFar);
    fillHits(query, 8 * k);
  }
  RTCIntersectContext context = makeContext(true);
  rtcIntersect16(valid, handles_->scene, &context, &query);
  return {hitsOf(query, 0, active[0]), hitsOf(query, 8, active[1])};
}

Int8 Bvh::occluded(const RayPacket& rays, Int8 active, Float8 t_min, Float8 t_max,
                   bool coherent) const {
  alignas(32) RTCRay8 query;
  fill(query, 0, rays, t_min, t_max);
  RTCIntersectContext context = makeContext(coherent);
  rtcOccluded8(reinterpret_cast<const int*>(&active), handles_->scene, &context, &query);
  return active & (simd::load(query.tfar) < simd::splat(0.f));
}

}  // namespace diorama
