// An object that moves, as its light and that of its surroundings need it.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/light_blockers.h"
#include "sim/light_grid.h"
#include "sim/render_scene.h"

namespace diorama {

struct LitObject {
  // Intervals of the light map in one of the coarse grid, as in baking.
  static constexpr int kCoarse = 3;

  LitObject(const RenderScene& scene, int discs, const LightMap& like);

  // Brings it to a pose, with the lights there.
  void place(const SE3& T_world_object, const std::vector<RectangleLight>& world_lights);

  Vector3f toWorld(const Vector3f& p) const { return R_world_object * p + t_world_object; }
  RayPacket inObject(const RayPacket& rays) const;

  // Whether it may stand between a light and some point of a sphere in the world.
  bool mayHide(size_t light, const Vector3f& center, float radius_m) const {
    return blockers.mayHide(lights[light], R_object_world * center + t_object_world, radius_m);
  }
  // Whether it fills enough of a hemisphere over some point of a sphere in the world to count.
  bool mayCount(const Vector3f& center, float sphere_radius_m) const;
  // The part of the hemisphere over a point that it fills, by the discs that face it.
  float share(const Vector3f& p, const Vector3f& n) const;

  // Takes direct light between coarse points. Returns the points around which these differ by more
  // than a part of the greatest.
  std::vector<uint32_t> takeDirect(const std::vector<Vector3f>& coarse, float part);

  // The light of the frame from `direct` and `gathered`; none.
  void publish();
  void darken();

  const RenderScene* scene;
  // Of its own light, object frame: places of the map's samples, and fewer where light that is
  // smooth is found.
  LightGrid grid, coarse_grid;
  std::vector<Vector3f> direct, gathered;  // irradiance / pi: in the grid, in the coarse grid
  LightMap map;
  Vector3f center = Vector3f::Zero();  // of a sphere around it, object frame
  float radius_m = 0;
  LightBlockers blockers;

  // This frame's pose, and what follows from it.
  bool is_lit = false;                 // has light of its own
  std::vector<RectangleLight> lights;  // object frame
  Eigen::Matrix3f R_world_object = Eigen::Matrix3f::Identity(), R_object_world = R_world_object;
  Vector3f t_world_object = Vector3f::Zero(), t_object_world = Vector3f::Zero(),
           center_world = Vector3f::Zero();

 private:
  // Eight discs that stand for parts of the surface.
  struct Discs {
    simd::Vector8 position, normal;
    simd::Float8 area_m2;
  };
  static std::vector<Discs> makeDiscs(const RenderScene& scene, int count);

  std::vector<Discs> discs_, discs_world_;
};

// Those of the active rays (world) that meet one of the objects before t = end.
simd::Int8 hiddenBy(const std::vector<const LitObject*>& objects, const RayPacket& rays,
                    simd::Int8 active, simd::Float8 end);

}  // namespace diorama
