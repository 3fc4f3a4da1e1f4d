#include "sim/moving_light.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "sim/chunks.h"
#include "sim/shading.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

constexpr size_t kRayChunk = 128;    // points per job
constexpr int kSmoothingPasses = 2;  // of light that some rays gather

// Neighbours of what is seen must be lit as well.
bool facesCamera(const LitPoint& point, const ViewCone& view) {
  constexpr float kTurned = 0.4f;
  return point.normal.dot((view.apex - point.position).normalized()) > -kTurned;
}

LitPoint pointOn(const LitObject& object, const LightGrid& grid, size_t p, float offset_m) {
  const Vector3f n = object.R_world_object * grid.normals[p];
  return {object.toWorld(grid.positions[p]) + offset_m * n, n, static_cast<uint32_t>(p)};
}

// Of the points of a grid, in the order of their groups.
std::vector<LightGrid::Cell> cellsAround(const LightGrid& grid, const LightGrid& coarse,
                                         const PointGroups& groups) {
  std::vector<uint32_t> place(grid.pointCount());
  for (uint32_t k = 0; k < groups.order.size(); ++k) place[groups.order[k]] = k;
  std::vector<LightGrid::Cell> cells(grid.pointCount());
  for (size_t k = 0; k < grid.resolution.size(); ++k) {
    const int r = grid.resolution[k];
    const float step = 1 / static_cast<float>(r);
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i)
        cells[place[grid.point(k, i, j)]] =
            coarse.cellAt(k, static_cast<float>(i) * step, static_cast<float>(j) * step);
  }
  return cells;
}

}  // namespace

MovingLight::MovingLight(std::shared_ptr<const RenderScene> scene,
                         const MovingLightOptions& options)
    : scene_(std::move(scene)),
      options_(options),
      grid_(makeLightGrid(*scene_)),
      coarse_grid_(makeLightGrid(*scene_, LitObject::kCoarse)),
      groups_(groupPoints(grid_.positions)),
      coarse_groups_(groupPoints(coarse_grid_.positions)),
      cells_(cellsAround(grid_, coarse_grid_, groups_)),
      around_(scene_->light) {
  first_sample_.assign(grid_.pointCount() + 1, 0);
  for (const uint32_t point : grid_.point_of_sample) ++first_sample_[point + 1];
  for (size_t p = 0; p < grid_.pointCount(); ++p) first_sample_[p + 1] += first_sample_[p];
  samples_.resize(grid_.point_of_sample.size());
  std::vector<uint32_t> next(first_sample_.begin(), first_sample_.end() - 1);
  for (uint32_t s = 0; s < samples_.size(); ++s) samples_[next[grid_.point_of_sample[s]]++] = s;
  for (const MovingObject& moving : scene_->moving)
    objects_.emplace_back(*moving.scene, options_.discs, around_);
}

MovingLight::~MovingLight() = default;

LightView MovingLight::around() const { return {scene_->lights, around_}; }
LightView MovingLight::of(size_t moving) const {
  return {objects_[moving].lights, objects_[moving].map};
}

void MovingLight::update(const std::vector<SE3>& T_world_moving, const ViewCone& view,
                         WorkerPool& pool) {
  DIORAMA_CHECK(T_world_moving.size() == objects_.size());
  for (size_t k = 0; k < objects_.size(); ++k) objects_[k].place(T_world_moving[k], scene_->lights);
  shadeAround(view, pool);
  chooseLit(view);
  // Direct light first, so that the objects give some back to each other.
  for (LitObject& object : objects_)
    if (object.is_lit) lightDirectly(object, view, pool);
  for (LitObject& object : objects_)
    if (object.is_lit && isSeen(object, view)) gatherLight(object, view, pool);
  for (LitObject& object : objects_)
    if (object.is_lit) object.publish();
}

bool MovingLight::isSeen(const LitObject& object, const ViewCone& view) const {
  return view.mayShow(object.center_world, object.radius_m);
}

// What the camera sees, and what lights that.
void MovingLight::chooseLit(const ViewCone& view) {
  for (LitObject& object : objects_) {
    const bool was_lit = object.is_lit;
    object.is_lit = std::any_of(objects_.begin(), objects_.end(), [&](const LitObject& other) {
      return isSeen(other, view) &&
             (&other == &object || object.mayCount(other.center_world, other.radius_m));
    });
    if (was_lit && !object.is_lit) object.darken();
  }
}

std::vector<const LitObject*> MovingLight::blockersOf(const LitObject& object, size_t light) const {
  std::vector<const LitObject*> blockers;
  for (const LitObject& other : objects_)
    if (other.mayHide(light, object.center_world, object.radius_m)) blockers.push_back(&other);
  return blockers;
}

// At the coarse points, and where these differ in the part that is seen at all points.
void MovingLight::lightDirectly(LitObject& object, const ViewCone& view, WorkerPool& pool) const {
  std::vector<HiddenRays> hidden;  // by light
  for (size_t light = 0; light < scene_->lights.size(); ++light)
    hidden.push_back([this, blockers = blockersOf(object, light)](const RayPacket& rays,
                                                                  Int8 active, Float8 end) {
      const Int8 by_objects = hiddenBy(blockers, rays, active, end);
      return by_objects | scene_->bvh->occluded(rays, active & ~by_objects, splat(0.f), end, true);
    });
  const auto lightAt = [&](const LightGrid& grid, size_t p) {
    const LitPoint point = pointOn(object, grid, p, options_.surface_offset_m);
    Vector3f sum = Vector3f::Zero();
    for (size_t k = 0; k < scene_->lights.size(); ++k)
      sum += directLight({&scene_->lights[k], 1}, point, options_.shadow_rays, hidden[k]);
    return sum;
  };
  std::vector<Vector3f> coarse(object.coarse_grid.pointCount());
  forChunks(coarse.size(), kRayChunk, pool,
            [&](size_t p) { coarse[p] = lightAt(object.coarse_grid, p); });
  const std::vector<uint32_t> uneven = object.takeDirect(coarse, kSmooth);
  forChunks(uneven.size(), kRayChunk, pool, [&](size_t k) {
    const uint32_t p = uneven[k];
    if (facesCamera(pointOn(object, object.grid, p, 0), view))
      object.direct[p] = lightAt(object.grid, p);
  });
  std::fill(object.gathered.begin(), object.gathered.end(), Vector3f::Zero());
  object.publish();
}

// What faces away from the camera is not seen and keeps its direct light.
void MovingLight::gatherLight(LitObject& object, const ViewCone& view, WorkerPool& pool) const {
  const SeenRadiance seen = [&](const RayPacket& rays, int& back_faces) {
    return radianceTowards(rays, back_faces);
  };
  std::vector<uint8_t> unknown(object.gathered.size(), 0);
  forChunks(object.gathered.size(), kRayChunk, pool, [&](size_t p) {
    const LitPoint point = pointOn(object, object.coarse_grid, p, options_.surface_offset_m);
    int back_faces = 0;
    if (facesCamera(point, view))
      object.gathered[p] = gatheredLight(point, options_.gather_rays, seen, back_faces);
    else
      unknown[p] = 1;
    unknown[p] |= back_faces * 4 > options_.gather_rays;
  });
  refill(object.coarse_grid, unknown, object.gathered);
  // Bounced light changes slowly: neighbours share their rays.
  for (int pass = 0; pass < kSmoothingPasses; ++pass)
    object.gathered = smoothed(object.coarse_grid, object.gathered);
}

Vector8 MovingLight::radianceTowards(const RayPacket& rays, int& back_faces) const {
  PacketHits nearest = scene_->bvh->closest(rays, splat(-1), splat(0.f), false);
  int nearest_backs = 0;
  Vector8 seen = shading::diffuseRadiance(*scene_, around(), rays, nearest, nearest_backs);
  for (size_t k = 0; k < objects_.size(); ++k) {
    if (!objects_[k].is_lit) continue;
    const RayPacket inside = objects_[k].inObject(rays);
    PacketHits hits = objects_[k].scene->bvh->closest(inside, splat(-1), splat(0.f), false);
    hits.mask &= hits.t < nearest.t;
    if (simd::bits(hits.mask) == 0) continue;
    seen = simd::select(
        hits.mask, shading::diffuseRadiance(*objects_[k].scene, of(k), inside, hits, nearest_backs),
        seen);
    nearest.t = simd::select(hits.mask, hits.t, nearest.t);
  }
  back_faces += nearest_backs;
  return seen;
}

}  // namespace diorama
