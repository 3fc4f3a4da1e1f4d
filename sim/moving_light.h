// The light of one frame in a scene where objects move: their shadows on what rests, and the light
// on themselves. What rests keeps its baked light; where a moving object stands before an area
// light, that light is taken away, and near it the bounced light is dimmed by the share of the
// hemisphere that the object fills (discs in place of its surface: M. Bunnell, Dynamic ambient
// occlusion and indirect lighting, GPU Gems 2). Light on moving objects that the camera sees is
// gathered by rays at a grid on their surfaces, as the baker does; a coarser one where it is
// smooth.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "sim/light_sampler.h"
#include "sim/lit_object.h"
#include "sim/point_groups.h"
#include "sim/render_scene.h"
#include "sim/worker_pool.h"

namespace diorama {

struct MovingLightOptions {
  int shadow_rays = 32;            // per light and sample, where a light is partly hidden
  int gather_rays = 24;            // for bounced light, per sample; neighbours share theirs
  int discs = 96;                  // per object, for the light that it keeps from what rests
  float surface_offset_m = 2e-4f;  // rays start this far above their surface
};

// What a frame needs to be lit: where the camera looks.
struct ViewCone {
  Vector3f apex, axis;  // world
  float cosine = -1;    // of the half angle; -1: all around
  bool sees(const Vector3f& p) const {
    const Vector3f d = p - apex;
    return axis.dot(d) >= cosine * d.norm();
  }
  // Whether some of a sphere may be seen.
  bool mayShow(const Vector3f& center, float radius_m) const {
    const Vector3f d = center - apex;
    const float distance = d.norm();
    if (distance <= radius_m) return true;
    const float to_center = std::acos(std::clamp(axis.dot(d) / distance, -1.f, 1.f));
    return to_center - std::asin(radius_m / distance) <= std::acos(cosine);
  }
};

class MovingLight {
 public:
  // The scene's light is baked.
  explicit MovingLight(std::shared_ptr<const RenderScene> scene,
                       const MovingLightOptions& options = {});
  ~MovingLight();

  // Lights a frame with RenderScene::moving at these poses, within the view only.
  void update(const std::vector<SE3>& T_world_moving, const ViewCone& view, WorkerPool& pool);

  LightView around() const;           // of what rests, in the world's frame
  LightView of(size_t moving) const;  // in the object's frame

 private:
  // Where coarse points differ by less, as a part of their light, it is taken between them.
  static constexpr float kSmooth = 0.02f;

  struct Change {
    uint32_t point;
    Vector3f light;
  };
  // What the objects take from a point: a part of its bounced light, and direct light.
  struct Loss {
    float part = 0;
    Vector3f direct = Vector3f::Zero();
  };
  static const Loss kUnknown;
  // Objects that may keep a light away.
  struct Blocked {
    size_t light;
    std::vector<const LitObject*> by;
  };

  // On what rests.
  void shadeAround(const ViewCone& view, WorkerPool& pool);
  // The objects that may change the light in a group of points.
  struct Influence {
    std::vector<const LitObject*> near;
    std::vector<Blocked> blocked;
    bool none() const { return near.empty() && blocked.empty(); }
  };
  Influence influenceOn(const PointGroup& group) const;
  void findCoarseLoss(const PointGroup& group, const ViewCone& view);
  void shadeGroup(const PointGroup& group, const ViewCone& view,
                  std::vector<Change>& changes) const;
  LitPoint pointOf(const LightGrid& grid, uint32_t p) const;
  Loss lossAt(const LitPoint& point, const Influence& influence) const;
  bool noLossAround(const LightGrid::Cell& cell) const;
  std::optional<Loss> lossBetween(const LightGrid::Cell& cell, const Vector3f& all,
                                  const Vector3f& bounced) const;
  Vector3f takenAt(const LitPoint& point, const std::vector<Blocked>& blocked) const;
  // On the objects.
  std::vector<const LitObject*> blockersOf(const LitObject& object, size_t light) const;
  void chooseLit(const ViewCone& view);
  bool isSeen(const LitObject& object, const ViewCone& view) const;
  void lightDirectly(LitObject& object, const ViewCone& view, WorkerPool& pool) const;
  void gatherLight(LitObject& object, const ViewCone& view, WorkerPool& pool) const;
  simd::Vector8 radianceTowards(const RayPacket& rays, int& back_faces) const;

  std::shared_ptr<const RenderScene> scene_;
  MovingLightOptions options_;
  // Of what rests: the light map's points, and fewer where losses that are smooth are found.
  LightGrid grid_, coarse_grid_;
  PointGroups groups_, coarse_groups_;
  std::vector<uint32_t> first_sample_, samples_;  // the samples of each point of grid_
  std::vector<LightGrid::Cell> cells_;  // of coarse points, around each point in its group's order
  std::vector<Loss> coarse_loss_;       // this frame's
  LightMap around_;
  std::vector<uint32_t> touched_;  // samples of around_ that differ from the baked ones
  std::vector<LitObject> objects_;
};

}  // namespace diorama
