// What moving objects take from the light on what rests.
#include <algorithm>
#include <limits>

#include "sim/chunks.h"
#include "sim/moving_light.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

constexpr size_t kGroupChunk = 32;  // groups of points per job
// Objects that fill less of a hemisphere dim nothing; twice as much counts in full.
constexpr float kLeastShare = 0.01f;
// What an object keeps from a point it partly gives back by its own light.
constexpr float kGivenBack = 0.35f;

}  // namespace

const MovingLight::Loss MovingLight::kUnknown{
    std::numeric_limits<float>::quiet_NaN(),
    Vector3f::Constant(std::numeric_limits<float>::quiet_NaN())};

// Points whose light a moving object changes get it anew; the others have their baked light. Losses
// are found at coarse points, and at all points where these differ: along a shadow's edge.
void MovingLight::shadeAround(const ViewCone& view, WorkerPool& pool) {
  for (const uint32_t s : touched_) around_.samples[s] = scene_->light.samples[s];
  touched_.clear();
  coarse_loss_.assign(coarse_grid_.pointCount(), kUnknown);
  forChunks(coarse_groups_.groups.size(), kGroupChunk, pool,
            [&](size_t k) { findCoarseLoss(coarse_groups_.groups[k], view); });
  std::vector<std::vector<Change>> changes((groups_.groups.size() + kGroupChunk - 1) / kGroupChunk);
  forChunks(groups_.groups.size(), kGroupChunk, pool,
            [&](size_t k) { shadeGroup(groups_.groups[k], view, changes[k / kGroupChunk]); });
  for (const std::vector<Change>& some : changes)
    for (const Change& change : some)
      for (uint32_t k = first_sample_[change.point]; k < first_sample_[change.point + 1]; ++k) {
        around_.samples[samples_[k]] = packLight(change.light, around_.max);
        touched_.push_back(samples_[k]);
      }
}

MovingLight::Influence MovingLight::influenceOn(const PointGroup& group) const {
  Influence result;
  for (const LitObject& object : objects_)
    if (object.mayCount(group.center, group.radius_m)) result.near.push_back(&object);
  for (size_t light = 0; light < scene_->lights.size(); ++light) {
    Blocked some{light, {}};
    for (const LitObject& object : objects_)
      if (object.mayHide(light, group.center, group.radius_m)) some.by.push_back(&object);
    if (!some.by.empty()) result.blocked.push_back(std::move(some));
  }
  return result;
}

void MovingLight::findCoarseLoss(const PointGroup& group, const ViewCone& view) {
  if (!view.mayShow(group.center, group.radius_m)) return;
  const Influence influence = influenceOn(group);
  for (uint32_t k = group.first; k < group.end; ++k) {
    const uint32_t p = coarse_groups_.order[k];
    coarse_loss_[p] = influence.none() ? Loss{} : lossAt(pointOf(coarse_grid_, p), influence);
  }
}

void MovingLight::shadeGroup(const PointGroup& group, const ViewCone& view,
                             std::vector<Change>& changes) const {
  if (!view.mayShow(group.center, group.radius_m)) return;
  const Influence influence = influenceOn(group);
  if (influence.none()) return;
  for (uint32_t k = group.first; k < group.end; ++k) {
    if (noLossAround(cells_[k])) continue;
    const uint32_t p = groups_.order[k];
    if (!view.sees(grid_.positions[p])) continue;
    const uint32_t sample = samples_[first_sample_[p]];
    const Vector3f all = unpackLight(scene_->light.samples[sample], around_.max);
    const Vector3f bounced = unpackLight(scene_->light.bounced[sample], around_.max);
    const std::optional<Loss> between = lossBetween(cells_[k], all, bounced);
    const Loss loss = between ? *between : lossAt(pointOf(grid_, p), influence);
    if (loss.part <= 0 && loss.direct.maxCoeff() <= 0) continue;
    const Vector3f direct = (all - bounced - loss.direct).cwiseMax(0);
    changes.push_back({p, direct + (1 - loss.part) * bounced});
  }
}

LitPoint MovingLight::pointOf(const LightGrid& grid, uint32_t p) const {
  return {grid.positions[p] + options_.surface_offset_m * grid.normals[p], grid.normals[p], p};
}

bool MovingLight::noLossAround(const LightGrid::Cell& cell) const {
  return std::all_of(cell.point.begin(), cell.point.end(), [&](uint32_t p) {
    const Loss& loss = coarse_loss_[p];
    return loss.part == 0 && loss.direct == Vector3f::Zero();
  });
}

// None where the coarse points around differ, or one of them is unknown.
std::optional<MovingLight::Loss> MovingLight::lossBetween(const LightGrid::Cell& cell,
                                                          const Vector3f& all,
                                                          const Vector3f& bounced) const {
  const Loss &a = coarse_loss_[cell.point[0]], &b = coarse_loss_[cell.point[1]],
             &c = coarse_loss_[cell.point[2]];
  const Vector3f direct = a.direct.cwiseMax(b.direct).cwiseMax(c.direct) -
                          a.direct.cwiseMin(b.direct).cwiseMin(c.direct);
  const float part = std::max({a.part, b.part, c.part}) - std::min({a.part, b.part, c.part});
  if (!((direct + part * bounced).maxCoeff() <= kSmooth * all.maxCoeff())) return std::nullopt;
  const auto mean = [&](const auto& x, const auto& y, const auto& z) {
    return cell.weight[0] * x + cell.weight[1] * y + cell.weight[2] * z;
  };
  const Loss loss{mean(a.part, b.part, c.part), mean(a.direct, b.direct, c.direct)};
  if (!(loss.part >= 0)) return std::nullopt;  // some of them unknown
  return loss;
}

MovingLight::Loss MovingLight::lossAt(const LitPoint& point, const Influence& influence) const {
  float share = 0;
  for (const LitObject* object : influence.near)
    share += object->share(point.position, point.normal);
  const float counts = std::clamp(share / kLeastShare - 1, 0.f, 1.f);
  return {std::min(share, 1.f) * (1 - kGivenBack) * counts, takenAt(point, influence.blocked)};
}

// The light of rays that arrive as long as the moving objects are not there.
Vector3f MovingLight::takenAt(const LitPoint& point, const std::vector<Blocked>& blocked) const {
  Vector3f taken = Vector3f::Zero();
  std::vector<const LitObject*> by;
  const HiddenRays kept = [&](const RayPacket& rays, Int8 active, Float8 end) {
    const Int8 by_objects = hiddenBy(by, rays, active, end);
    if (simd::bits(by_objects) == 0) return active;
    const Int8 anyway = scene_->bvh->occluded(rays, by_objects, splat(0.f), end, true);
    return active & ~(by_objects & ~anyway);
  };
  for (const Blocked& some : blocked) {
    const RectangleLight& light = scene_->lights[some.light];
    if (point.normal.dot(light.center - point.position) <= -light.half_u - light.half_v) continue;
    by.clear();
    for (const LitObject* object : some.by)
      if (object->mayHide(some.light, point.position, 0)) by.push_back(object);
    if (!by.empty()) taken += directLight({&light, 1}, point, options_.shadow_rays, kept);
  }
  return taken;
}

}  // namespace diorama
