#include "sim/moving_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/errors.h"
#include "sim/shading.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

constexpr size_t kChunk = 2048, kRayChunk = 128;  // points per job
// An object that fills less of a hemisphere dims nothing; twice as much counts in full.
constexpr float kLeastShare = 0.01f;
// What an object keeps from a point it partly gives back by its own light.
constexpr float kGivenBack = 0.35f;
constexpr int kSmoothingPasses = 3;  // of light that some rays gather

// A disc that stands for a part of a surface.
struct Disc {
  Vector3f position, normal;
  float area_m2 = 0;
};

// Triangles at even steps of the area, in the order of the mesh.
std::vector<Disc> makeDiscs(const RenderScene& scene, int count) {
  std::vector<float> until;
  float total = 0;
  const auto edges = [&](uint32_t k) {
    const Vector3f p0 = scene.corner(k, 0);
    return std::pair<Vector3f, Vector3f>(scene.corner(k, 1) - p0, scene.corner(k, 2) - p0);
  };
  for (uint32_t k = 0; k < scene.triangles.size(); ++k) {
    const auto [e1, e2] = edges(k);
    until.push_back(total += 0.5f * e1.cross(e2).norm());
  }
  std::vector<Disc> discs;
  if (!(total > 0)) return discs;
  for (int d = 0; d < count; ++d) {
    const float place = total * (static_cast<float>(d) + 0.5f) / static_cast<float>(count);
    const auto found = std::lower_bound(until.begin(), until.end(), place);
    const auto k = static_cast<uint32_t>(std::min(found, until.end() - 1) - until.begin());
    const auto [e1, e2] = edges(k);
    discs.push_back({scene.corner(k, 0) + (e1 + e2) / 3, e1.cross(e2).normalized(),
                     total / static_cast<float>(count)});
  }
  return discs;
}

Vector8 turned(const Eigen::Matrix3f& R, const Vector8& v) {
  const auto row = [&](int r) { return R(r, 0) * v.x + R(r, 1) * v.y + R(r, 2) * v.z; };
  return {row(0), row(1), row(2)};
}

template <class Fn>
void forChunks(size_t count, size_t chunk_size, WorkerPool& pool, const Fn& fn) {
  pool.run(static_cast<int>((count + chunk_size - 1) / chunk_size), [&](int chunk) {
    const size_t first = static_cast<size_t>(chunk) * chunk_size;
    for (size_t p = first; p < std::min(count, first + chunk_size); ++p) fn(p);
  });
}

}  // namespace

struct MovingLight::Object {
  const RenderScene* scene = nullptr;
  LightGrid grid;  // object frame
  std::vector<Disc> discs;
  Eigen::AlignedBox3f box;             // object frame
  Vector3f center = Vector3f::Zero();  // of a sphere around it, object frame
  float radius_m = 0;
  std::vector<Vector3f> direct, gathered;  // irradiance / pi at the points of the grid
  LightMap map;
  std::vector<RectangleLight> lights;  // object frame
  // This frame's pose, and what follows from it, in the world.
  Eigen::Matrix3f R_world_object = Eigen::Matrix3f::Identity(), R_object_world = R_world_object;
  Vector3f t_world_object = Vector3f::Zero(), t_object_world = Vector3f::Zero(),
           center_world = Vector3f::Zero();
  std::vector<Disc> discs_world;

  void place(const SE3& T_world_object, const std::vector<RectangleLight>& world_lights) {
    const SE3 T_object_world = T_world_object.inverse();
    R_world_object = T_world_object.rotationMatrix().cast<float>();
    R_object_world = R_world_object.transpose();
    t_world_object = T_world_object.translation.cast<float>();
    t_object_world = T_object_world.translation.cast<float>();
    center_world = toWorld(center);
    discs_world = discs;
    for (Disc& disc : discs_world) {
      disc.position = toWorld(disc.position);
      disc.normal = R_world_object * disc.normal;
    }
    lights = world_lights;
    for (RectangleLight& light : lights) {
      light.center = R_object_world * light.center + t_object_world;
      for (Vector3f* axis : {&light.axis_u, &light.axis_v, &light.normal})
        *axis = R_object_world * *axis;
    }
  }

  Vector3f toWorld(const Vector3f& p) const { return R_world_object * p + t_world_object; }

  RayPacket inObject(const RayPacket& rays) const {
    return {turned(R_object_world, rays.origin) + simd::splat3(t_object_world),
            turned(R_object_world, rays.direction)};
  }

  // Whether the box may stand between a point (object frame) and a light. At the share s of the way
  // the rays to the light keep within s times its half diagonal.
  bool mayHide(const RectangleLight& light, const Vector3f& p) const {
    const Vector3f way = light.center - p;
    const float half = std::hypot(light.half_u, light.half_v);
    float from = 0, to = 1;
    const auto keep = [&](float a, float b) {  // where a + b s >= 0
      if (b > 0) from = std::max(from, -a / b);
      if (b < 0) to = std::min(to, -a / b);
      if (b == 0 && a < 0) to = -1;
    };
    for (int axis = 0; axis < 3; ++axis) {
      keep(p[axis] - box.min()[axis], half + way[axis]);
      keep(box.max()[axis] - p[axis], half - way[axis]);
    }
    return from <= to;
  }

  void publish() {
    for (size_t s = 0; s < map.samples.size(); ++s) {
      const uint32_t p = grid.point_of_sample[s];
      map.samples[s] = packLight(direct[p] + gathered[p], map.max);
    }
  }

  // The part of the hemisphere over a point that the object fills, by the discs that face it.
  float share(const Vector3f& p, const Vector3f& n) const {
    const float distance2 = (center_world - p).squaredNorm();
    if (radius_m * radius_m < kLeastShare * distance2 || n.dot(center_world - p) < -radius_m)
      return 0;
    float sum = 0;
    for (const Disc& disc : discs_world) {
      const Vector3f to = disc.position - p;
      const float r2 = to.squaredNorm(), above = n.dot(to), faces = -disc.normal.dot(to);
      if (above <= 0 || faces <= 0) continue;
      sum += disc.area_m2 * above * faces / (r2 * (std::numbers::pi_v<float> * r2 + disc.area_m2));
    }
    return std::min(sum, 1.f);
  }
};

MovingLight::MovingLight(std::shared_ptr<const RenderScene> scene,
                         const MovingLightOptions& options)
    : scene_(std::move(scene)), options_(options), around_(scene_->light) {
  grid_ = makeLightGrid(*scene_);
  first_sample_.assign(grid_.pointCount() + 1, 0);
  for (const uint32_t point : grid_.point_of_sample) ++first_sample_[point + 1];
  for (size_t p = 0; p < grid_.pointCount(); ++p) first_sample_[p + 1] += first_sample_[p];
  samples_.resize(grid_.point_of_sample.size());
  std::vector<uint32_t> next(first_sample_.begin(), first_sample_.end() - 1);
  for (uint32_t s = 0; s < samples_.size(); ++s) samples_[next[grid_.point_of_sample[s]]++] = s;

  for (const MovingObject& moving : scene_->moving) {
    Object object;
    object.scene = moving.scene.get();
    object.grid = makeLightGrid(*object.scene);
    object.discs = makeDiscs(*object.scene, options_.discs);
    for (const Vector3f& p : object.grid.positions) object.box.extend(p);
    object.center = object.box.center();
    object.radius_m = 0.5f * object.box.diagonal().norm();
    object.map = {.samples = std::vector<uint32_t>(object.grid.point_of_sample.size()),
                  .bounced = {},
                  .max = around_.max,
                  .typical = around_.typical};
    object.direct.resize(object.grid.pointCount());
    object.gathered.resize(object.grid.pointCount());
    objects_.push_back(std::move(object));
  }
}

MovingLight::~MovingLight() = default;

LitPoint MovingLight::pointOf(const Object& object, size_t p) const {
  const Vector3f n = object.R_world_object * object.grid.normals[p];
  return {object.toWorld(object.grid.positions[p]) + options_.surface_offset_m * n, n,
          static_cast<uint32_t>(p)};
}

LightView MovingLight::around() const { return {scene_->lights, around_}; }
LightView MovingLight::of(size_t moving) const {
  return {objects_[moving].lights, objects_[moving].map};
}

void MovingLight::update(const std::vector<SE3>& T_world_moving, const ViewCone& view,
                         WorkerPool& pool) {
  DIORAMA_CHECK(T_world_moving.size() == objects_.size());
  for (size_t k = 0; k < objects_.size(); ++k) objects_[k].place(T_world_moving[k], scene_->lights);
  shadeAround(view, pool);
  const auto isSeen = [&](const Object& object) {
    return view.mayShow(object.center_world, object.radius_m);
  };
  if (std::none_of(objects_.begin(), objects_.end(), isSeen)) return;
  // Direct light first, so that the objects give some back to each other.
  for (Object& object : objects_) lightDirectly(object, pool);
  for (Object& object : objects_) object.publish();
  for (Object& object : objects_)
    if (isSeen(object)) gatherLight(object, view, pool);
  for (Object& object : objects_) object.publish();
}

// Points whose light a moving object changes get it anew; the others have their baked light.
void MovingLight::shadeAround(const ViewCone& view, WorkerPool& pool) {
  for (const uint32_t s : touched_) around_.samples[s] = scene_->light.samples[s];
  touched_.clear();
  const size_t chunks = (grid_.pointCount() + kChunk - 1) / kChunk;
  std::vector<std::vector<Change>> changes(chunks);
  forChunks(grid_.pointCount(), kChunk, pool, [&](size_t p) {
    if (!view.sees(grid_.positions[p])) return;
    if (const auto change = changeAt(static_cast<uint32_t>(p)))
      changes[p / kChunk].push_back(*change);
  });
  for (const std::vector<Change>& some : changes)
    for (const Change& change : some)
      for (uint32_t k = first_sample_[change.point]; k < first_sample_[change.point + 1]; ++k) {
        around_.samples[samples_[k]] = packLight(change.light, around_.max);
        touched_.push_back(samples_[k]);
      }
}

std::optional<MovingLight::Change> MovingLight::changeAt(uint32_t point) const {
  const Vector3f& p = grid_.positions[point];
  const Vector3f& n = grid_.normals[point];
  float share = 0;
  for (const Object& object : objects_) share += object.share(p, n);
  const float dimmed =
      std::min(share, 1.f) * (1 - kGivenBack) * std::clamp(share / kLeastShare - 1, 0.f, 1.f);

  // The light of rays that arrive as long as the moving objects are not there.
  const HiddenRays kept = [&](const RayPacket& rays, Int8 active, Float8 end) {
    const Int8 by_objects = hiddenByObjects(rays, active, end);
    if (simd::bits(by_objects) == 0) return active;
    const Int8 anyway = scene_->bvh->occluded(rays, by_objects, splat(0.f), end, true);
    return active & ~(by_objects & ~anyway);
  };
  const LitPoint lit{p + options_.surface_offset_m * n, n, point};
  Vector3f taken = Vector3f::Zero();
  for (size_t k = 0; k < scene_->lights.size(); ++k) {
    const RectangleLight& light = scene_->lights[k];
    const auto mayHide = [&](const Object& o) {
      return o.mayHide(o.lights[k], o.R_object_world * p + o.t_object_world);
    };
    if (n.dot(light.center - p) > -light.half_u - light.half_v &&
        std::any_of(objects_.begin(), objects_.end(), mayHide))
      taken += directLight({&light, 1}, lit, options_.shadow_rays, kept);
  }

  if (dimmed <= 0 && taken.maxCoeff() <= 0) return std::nullopt;
  const uint32_t sample = samples_[first_sample_[point]];
  const Vector3f all = unpackLight(scene_->light.samples[sample], around_.max);
  const Vector3f bounced = unpackLight(scene_->light.bounced[sample], around_.max);
  const Vector3f direct = (all - bounced - taken).cwiseMax(0);
  return Change{point, direct + (1 - dimmed) * bounced};
}

Int8 MovingLight::hiddenByObjects(const RayPacket& rays, Int8 active, Float8 end) const {
  Int8 hidden = splat(0);
  for (const Object& object : objects_)
    hidden |=
        object.scene->bvh->occluded(object.inObject(rays), active & ~hidden, splat(0.f), end, true);
  return hidden;
}

Vector8 MovingLight::radianceTowards(const RayPacket& rays, int& back_faces) const {
  PacketHits nearest = scene_->bvh->closest(rays, splat(-1), splat(0.f), false);
  int nearest_backs = 0;
  Vector8 seen = shading::diffuseRadiance(*scene_, around(), rays, nearest, nearest_backs);
  for (size_t k = 0; k < objects_.size(); ++k) {
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

void MovingLight::lightDirectly(Object& object, WorkerPool& pool) const {
  const HiddenRays hidden = [&](const RayPacket& rays, Int8 active, Float8 end) {
    const Int8 by_objects = hiddenByObjects(rays, active, end);
    return by_objects | scene_->bvh->occluded(rays, active & ~by_objects, splat(0.f), end, true);
  };
  forChunks(object.direct.size(), kRayChunk, pool, [&](size_t p) {
    object.direct[p] =
        directLight(scene_->lights, pointOf(object, p), options_.shadow_rays, hidden);
  });
  std::fill(object.gathered.begin(), object.gathered.end(), Vector3f::Zero());
}

// What faces away from the camera is not seen and keeps its direct light.
void MovingLight::gatherLight(Object& object, const ViewCone& view, WorkerPool& pool) const {
  const SeenRadiance seen = [&](const RayPacket& rays, int& back_faces) {
    return radianceTowards(rays, back_faces);
  };
  std::vector<uint8_t> unknown(object.gathered.size(), 0);
  forChunks(object.gathered.size(), kRayChunk, pool, [&](size_t p) {
    const LitPoint point = pointOf(object, p);
    constexpr float kTurned = 0.4f;  // neighbours of what is seen must be lit as well
    int back_faces = 0;
    if (point.normal.dot((view.apex - point.position).normalized()) > -kTurned)
      object.gathered[p] = gatheredLight(point, options_.gather_rays, seen, back_faces);
    else
      unknown[p] = 1;
    unknown[p] |= back_faces * 4 > options_.gather_rays;
  });
  refill(object.grid, unknown, object.gathered);
  // Bounced light changes slowly: neighbours share their rays.
  for (int pass = 0; pass < kSmoothingPasses; ++pass)
    object.gathered = smoothed(object.grid, object.gathered);
}

}  // namespace diorama
