// A scene ready to be drawn: triangles of all that rests in world coordinates, with all that
// shading needs, materials, textures, lights, ray hierarchies and baked light.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/mesh.h"
#include "sim/bvh.h"
#include "sim/closed_surfaces.h"
#include "sim/scene.h"
#include "sim/texture.h"

namespace diorama {

// One triangle, 128 bytes. Attributes at barycentric (u, v) are a0 + u a1 + v a2: entries 1 and 2
// are differences to corner 0.
struct alignas(128) ShadingTriangle {
  float normal0[3] = {}, normal1[3] = {}, normal2[3] = {};
  float uv0[2] = {}, uv1[2] = {}, uv2[2] = {};
  float gradient_u[3] = {}, gradient_v[3] = {};  // of the texture coordinates over the surface, 1/m
  float log2_density = 0;                        // of texels per metre
  float plane[3] = {0, 0, 1};                    // unit normal of the triangle itself
  int light_offset = 0;                          // first sample in LightMap::samples
  int light_resolution = 1;                      // intervals along an edge
  int material = 0;
  int instance = 0;  // 0: environment, i + 1: object i of the scene
  int patch = 0;     // sim/patches.h
};

struct ShadingMaterial {
  float tint[3] = {1, 1, 1};  // linear
  float specular = 0;         // reflectance at normal incidence
  float lobe = 0.2f;          // half width of the highlight, tangent
  float emission[3] = {};     // radiance, multiplied with the texture
  bool emits = false;
  Texture texture;
};

struct RectangleLight {
  Vector3f center, axis_u, axis_v, normal;  // unit axes; light leaves on the normal's side
  float half_u = 0, half_v = 0;             // m
  Vector3f radiance;
  float body_m = 0;  // thickness of what is drawn as the lamp: it casts no shadow
};

// What arrives at the surfaces, diffusely: irradiance / pi, so that radiance = albedo * light. The
// samples of a triangle with resolution R lie at u = i / R, v = j / R, i + j <= R, rows of constant
// j one after the other. Stored with 11, 11 and 10 bits of the square root of light / max.
struct LightMap {
  std::vector<uint32_t> samples;
  std::vector<uint32_t> bounced;  // the part that does not come straight from an area light
  float max = 1;
  float typical = 1;  // mean over all samples
};
uint32_t packLight(const Vector3f& light, float max);
Vector3f unpackLight(uint32_t sample, float max);

// What lights the triangles of a scene in one frame.
struct LightView {
  std::span<const RectangleLight> lights;
  const LightMap& map;
};

// Objects in the scene's order behind the environment (instance 0).
struct SceneInstance {
  uint32_t first_triangle = 0, triangle_count = 0;  // none when it moves
  bool tracked = false;
  Vector3d min_corner, max_corner;   // object frame, m
  SE3 T_world_object;                // where it rests
  int moving = -1;                   // its place in RenderScene::moving
  std::shared_ptr<const Bvh> alone;  // tracked objects, for silhouettes; object frame when it moves
};

struct RenderScene;

// An object on a path of its own: a scene in the object's frame, whose light is made anew in each
// frame (sim/moving_light.h). Its triangles carry the object's instance id.
struct MovingObject {
  size_t object = 0;  // in Scene::objects
  std::shared_ptr<const RenderScene> scene;
};

struct RenderScene {
  std::vector<Vector3f> corners;  // m, world; one spare behind the end
  std::vector<uint32_t> indices;  // three per triangle
  std::vector<ShadingTriangle> triangles;
  std::vector<ShadingMaterial> materials;
  std::vector<SceneInstance> instances;
  std::vector<MovingObject> moving;
  std::vector<RectangleLight> lights;
  std::vector<uint8_t> is_lamp;  // per triangle: the visible body of one of the lights
  TextureAtlas textures;
  Vector3f sky = Vector3f::Zero();  // radiance of what no surface hides
  LightMap light;
  std::shared_ptr<const Bvh> bvh;        // for truth and for baking
  std::shared_ptr<const Bvh> quick_bvh;  // for colours
  ClosedSurfaces closed;

  Vector3f corner(uint32_t triangle, int k) const {
    return corners[indices[3 * triangle + static_cast<uint32_t>(k)]];
  }
  // (p1 - p0) x (p2 - p0)
  Vector3f normal(uint32_t triangle) const {
    const Vector3f p0 = corner(triangle, 0);
    return (corner(triangle, 1) - p0).cross(corner(triangle, 2) - p0);
  }
  LightView lightView() const { return {lights, light}; }
};

// Imports every mesh of a scene. The light is not baked yet. Throws MissingInputError or
// InputError.
RenderScene makeRenderScene(const Scene& scene);

}  // namespace diorama
