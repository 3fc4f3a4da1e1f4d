// The light of one frame in a scene where objects move: their shadows on what rests, and the light
// on themselves. What rests keeps its baked light; where a moving object stands before an area
// light, that light is taken away, and near it the bounced light is dimmed by the share of the
// hemisphere that the object fills (discs in place of its surface: M. Bunnell, Dynamic ambient
// occlusion and indirect lighting, GPU Gems 2). Light on moving objects is gathered by rays at a
// grid on their surfaces, as the baker does.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "sim/light_grid.h"
#include "sim/light_sampler.h"
#include "sim/render_scene.h"
#include "sim/worker_pool.h"

namespace diorama {

struct MovingLightOptions {
  int shadow_rays = 32;            // per light and sample, where a light is partly hidden
  int gather_rays = 16;            // for bounced light, per sample; neighbours share theirs
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
  struct Object;
  struct Change {
    uint32_t point;
    Vector3f light;
  };

  LitPoint pointOf(const Object& object, size_t p) const;
  void lightDirectly(Object& object, WorkerPool& pool) const;
  void gatherLight(Object& object, const ViewCone& view, WorkerPool& pool) const;
  void shadeAround(const ViewCone& view, WorkerPool& pool);
  std::optional<Change> changeAt(uint32_t point) const;
  simd::Int8 hiddenByObjects(const RayPacket& rays, simd::Int8 active, simd::Float8 end) const;
  simd::Vector8 radianceTowards(const RayPacket& rays, int& back_faces) const;

  std::shared_ptr<const RenderScene> scene_;
  MovingLightOptions options_;
  LightGrid grid_;                                // of what rests
  std::vector<uint32_t> first_sample_, samples_;  // the samples of each point of grid_
  LightMap around_;
  std::vector<uint32_t> touched_;  // samples of around_ that differ from the baked ones
  std::vector<Object> objects_;
};

}  // namespace diorama
