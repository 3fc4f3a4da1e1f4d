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

void put(float* to, Float8 v) { simd::store(to, v); }
void fill(RTCRay8& ray, const RayPacket& rays, Float8 t_min, Float8 t_max) {
  put(ray.org_x, rays.origin.x);
  put(ray.org_y, rays.origin.y);
  put(ray.org_z, rays.origin.z);
  put(ray.dir_x, rays.direction.x);
  put(ray.dir_y, rays.direction.y);
  put(ray.dir_z, rays.direction.z);
  put(ray.tnear, t_min);
  put(ray.tfar, t_max);
  put(ray.time, simd::splat(0.f));
  const Int8 all = simd::splat(-1), none = simd::splat(0);
  std::memcpy(ray.mask, &all, sizeof all);
  std::memcpy(ray.id, &none, sizeof none);
  std::memcpy(ray.flags, &none, sizeof none);
}

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
  alignas(32) int valid[8];
  std::memcpy(valid, &active, sizeof valid);
  fill(query.ray, rays, t_min, simd::splat(std::numeric_limits<float>::infinity()));
  const Int8 nothing = simd::splat(-1), zero = simd::splat(0);
  std::memcpy(query.hit.geomID, &nothing, sizeof nothing);
  std::memcpy(query.hit.primID, &zero, sizeof zero);
  std::memcpy(query.hit.instID[0], &nothing, sizeof nothing);
  RTCIntersectContext context = makeContext(coherent);
  rtcIntersect8(valid, handles_->scene, &context, &query);
  PacketHits hits;
  hits.t = simd::load(query.ray.tfar);
  hits.u = simd::load(query.hit.u);
  hits.v = simd::load(query.hit.v);
  hits.normal = {simd::load(query.hit.Ng_x), simd::load(query.hit.Ng_y),
                 simd::load(query.hit.Ng_z)};
  Int8 geometry;
  std::memcpy(&geometry, query.hit.geomID, sizeof geometry);
  std::memcpy(&hits.triangle, query.hit.primID, sizeof hits.triangle);
  hits.mask = active & (geometry != nothing);
  return hits;
}

Int8 Bvh::occluded(const RayPacket& rays, Int8 active, Float8 t_min, Float8 t_max,
                   bool coherent) const {
  alignas(32) RTCRay8 query;
  alignas(32) int valid[8];
  std::memcpy(valid, &active, sizeof valid);
  fill(query, rays, t_min, t_max);
  RTCIntersectContext context = makeContext(coherent);
  rtcOccluded8(valid, handles_->scene, &context, &query);
  return active & (simd::load(query.tfar) < simd::splat(0.f));
}

}  // namespace diorama
