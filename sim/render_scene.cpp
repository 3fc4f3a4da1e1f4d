#include "sim/render_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "sim/light_grid.h"
#include "sim/mesh_import.h"
#include "sim/patches.h"

namespace diorama {
namespace {

void set(float* to, const Vector3f& v) { std::copy_n(v.data(), 3, to); }
void set(float* to, const Eigen::Vector2f& v) { std::copy_n(v.data(), 2, to); }

ShadingMaterial makeMaterial(const Material& material, TextureAtlas& textures) {
  ShadingMaterial result;
  set(result.tint, material.diffuse);
  set(result.emission, material.emission);
  result.emits = material.emission.maxCoeff() > 0;
  result.specular = material.specular;
  // Where a Blinn-Phong lobe has fallen to about a fifth, seen from the mirror direction.
  result.lobe = std::min(1.5f, 2.5f * std::sqrt(2.f / (material.shininess + 2.f)));
  result.texture = textures.texture(material.texture.empty() ? 0 : textures.add(material.texture));
  return result;
}

class Builder {
 public:
  explicit Builder(RenderScene& scene) : scene_(scene) {}

  // Gives the triangles an instance id and a place in the scene's frame.
  SceneInstance add(const Mesh& mesh, const SE3& T_world_object, int id) {
    mesh_ = &mesh;
    id_ = id;
    first_corner_ = static_cast<uint32_t>(scene_.corners.size());
    first_material_ = static_cast<int>(scene_.materials.size());
    rotation_ = T_world_object.rotationMatrix().cast<float>();
    for (const Vector3f& p : mesh.positions)
      scene_.corners.emplace_back((T_world_object * p.cast<double>()).cast<float>());
    for (const Material& material : mesh.materials)
      scene_.materials.push_back(makeMaterial(material, scene_.textures));
    SceneInstance instance;
    instance.first_triangle = static_cast<uint32_t>(scene_.triangles.size());
    instance.triangle_count = static_cast<uint32_t>(mesh.triangles.size());
    instance.min_corner = mesh.minCorner().cast<double>();
    instance.max_corner = mesh.maxCorner().cast<double>();
    instance.T_world_object = T_world_object;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) addTriangle(k);
    return instance;
  }

 private:
  void addTriangle(size_t index) {
    const Eigen::Vector3i& corner = mesh_->triangles[index];
    for (int k = 0; k < 3; ++k)
      scene_.indices.push_back(first_corner_ + static_cast<uint32_t>(corner[k]));
    ShadingTriangle t;
    t.instance = id_;
    t.material = first_material_ + mesh_->triangle_materials[index];
    const auto id = static_cast<uint32_t>(scene_.triangles.size());
    const Vector3f p0 = scene_.corner(id, 0), e1 = scene_.corner(id, 1) - p0,
                   e2 = scene_.corner(id, 2) - p0;
    const Vector3f cross = e1.cross(e2);
    Vector3f normal[3];
    for (int k = 0; k < 3; ++k)
      normal[k] = mesh_->normals.empty()
                      ? cross.normalized()
                      : rotation_ * mesh_->normals[static_cast<size_t>(corner[k])];
    if (cross.squaredNorm() > 0) set(t.plane, Vector3f(cross.normalized()));
    set(t.normal0, normal[0]);
    set(t.normal1, Vector3f(normal[1] - normal[0]));
    set(t.normal2, Vector3f(normal[2] - normal[0]));
    if (!mesh_->uvs.empty()) setTexture(t, corner, e1, e2, cross);
    scene_.triangles.push_back(t);
  }

  void setTexture(ShadingTriangle& t, const Eigen::Vector3i& corner, const Vector3f& e1,
                  const Vector3f& e2, const Vector3f& cross) {
    const auto uv = [&](int k) { return mesh_->uvs[static_cast<size_t>(corner[k])]; };
    const Eigen::Vector2f d1 = uv(1) - uv(0), d2 = uv(2) - uv(0);
    set(t.uv0, uv(0));
    set(t.uv1, d1);
    set(t.uv2, d2);
    const float area2 = std::max(cross.squaredNorm(), 1e-30f);
    const Vector3f b1 = e2.cross(cross) / area2, b2 = cross.cross(e1) / area2;  // grad of (u, v)
    const Vector3f gu = b1 * d1.x() + b2 * d2.x(), gv = b1 * d1.y() + b2 * d2.y();
    set(t.gradient_u, gu);
    set(t.gradient_v, gv);
    const Texture& texture = scene_.materials[static_cast<size_t>(t.material)].texture;
    const float texels =
        static_cast<float>(1 << texture.log_width) * static_cast<float>(1 << texture.log_height);
    t.log2_density = 0.5f * std::log2(std::max(1e-12f, gu.cross(gv).norm() * texels));
  }

  RenderScene& scene_;
  const Mesh* mesh_ = nullptr;
  int id_ = 0;
  uint32_t first_corner_ = 0;
  int first_material_ = 0;
  Eigen::Matrix3f rotation_;
};

RectangleLight makeLight(const AreaLight& light) {
  RectangleLight result;
  result.center = light.center.cast<float>();
  result.half_u = static_cast<float>(light.half_u.norm());
  result.half_v = static_cast<float>(light.half_v.norm());
  result.axis_u = light.half_u.normalized().cast<float>();
  result.axis_v = light.half_v.normalized().cast<float>();
  result.normal = light.half_u.cross(light.half_v).normalized().cast<float>();
  result.radiance = light.radiance.cast<float>();
  return result;
}

// An emissive triangle that lies on a light is its body: the light itself is sampled, so the body
// must neither hide it nor shine a second time.
bool markLamp(RenderScene& scene, uint32_t triangle) {
  constexpr float kThickness_m = 0.05f;
  const int material = scene.triangles[triangle].material;
  if (!scene.materials[static_cast<size_t>(material)].emits) return false;
  const Vector3f center =
      (scene.corner(triangle, 0) + scene.corner(triangle, 1) + scene.corner(triangle, 2)) / 3;
  for (RectangleLight& light : scene.lights) {
    const Vector3f d = center - light.center;
    if (std::abs(d.dot(light.normal)) > kThickness_m ||
        std::abs(d.dot(light.axis_u)) > light.half_u + kThickness_m ||
        std::abs(d.dot(light.axis_v)) > light.half_v + kThickness_m)
      continue;
    light.body_m = 1.1f * kThickness_m;
    return true;
  }
  return false;
}

void finish(RenderScene& scene) {
  findPatches(scene);
  scene.is_lamp.resize(scene.triangles.size());
  for (uint32_t k = 0; k < scene.triangles.size(); ++k) scene.is_lamp[k] = markLamp(scene, k);
  scene.corners.emplace_back(Vector3f::Zero());  // spare
  const std::span<const Vector3f> corners(scene.corners.data(), scene.corners.size() - 1);
  const std::span<const uint32_t> indices(scene.indices);
  scene.bvh = std::make_shared<Bvh>(corners, indices);
  scene.quick_bvh = std::make_shared<Bvh>(corners, indices, Traversal::kQuick);
  scene.closed = findClosedSurfaces(scene);
  for (SceneInstance& instance : scene.instances)
    if (instance.tracked && instance.moving < 0)
      instance.alone = std::make_shared<Bvh>(
          corners, indices.subspan(3 * instance.first_triangle, 3 * instance.triangle_count));
}

// A scene of its own in the object's frame, which does not stay where its memory is.
std::shared_ptr<const RenderScene> makeMovingScene(const Mesh& mesh, int id,
                                                   SceneInstance& instance) {
  auto scene = std::make_shared<RenderScene>();
  instance = Builder(*scene).add(mesh, SE3{}, id);
  layOutLight(*scene, {.spacing_m = 0.006, .growth = 0, .max_samples = 60'000});
  finish(*scene);
  instance.alone = scene->bvh;
  return scene;
}

void addObject(RenderScene& scene, Builder& builder, const SceneObject& object, size_t index) {
  const Mesh mesh = importMesh(object.mesh, {object.scale, object.y_up});
  const int id = static_cast<int>(index) + 1;
  SceneInstance instance;
  if (object.path) {
    scene.moving.push_back({index, makeMovingScene(mesh, id, instance)});
    instance.moving = static_cast<int>(scene.moving.size()) - 1;
  } else {
    instance = builder.add(mesh, object.T_world_object, id);
  }
  instance.tracked = object.tracked;
  scene.instances.push_back(std::move(instance));
}

}  // namespace

uint32_t packLight(const Vector3f& light, float max) {
  const auto quantise = [&](float x, float levels) {
    return static_cast<uint32_t>(std::lround(levels * std::sqrt(std::clamp(x / max, 0.f, 1.f))));
  };
  return quantise(light.x(), 2047) | quantise(light.y(), 2047) << 11 |
         quantise(light.z(), 1023) << 22;
}

Vector3f unpackLight(uint32_t sample, float max) {
  const auto square = [](uint32_t q, float levels) {
    const float x = static_cast<float>(q) / levels;
    return x * x;
  };
  return max * Vector3f(square(sample & 2047, 2047), square(sample >> 11 & 2047, 2047),
                        square(sample >> 22, 1023));
}

RenderScene makeRenderScene(const Scene& scene) {
  RenderScene result;
  for (const AreaLight& light : scene.lights) result.lights.push_back(makeLight(light));
  Builder builder(result);
  result.instances.push_back(scene.environment_mesh.empty()
                                 ? SceneInstance{}
                                 : builder.add(importMesh(scene.environment_mesh), SE3{}, 0));
  for (size_t i = 0; i < scene.objects.size(); ++i) addObject(result, builder, scene.objects[i], i);
  const bool emits = std::any_of(result.materials.begin(), result.materials.end(),
                                 [](const ShadingMaterial& m) { return m.emits; });
  const bool dark = result.lights.empty() && !emits && scene.ambient <= 0;
  result.sky.setConstant(dark ? 1.f : static_cast<float>(scene.ambient));
  finish(result);
  return result;
}

}  // namespace diorama
