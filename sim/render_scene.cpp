#include "sim/render_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "sim/mesh_import.h"

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

  void add(const Mesh& mesh, const SE3& T_world_object, bool tracked) {
    mesh_ = &mesh;
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
    instance.tracked = tracked;
    instance.min_corner = mesh.minCorner().cast<double>();
    instance.max_corner = mesh.maxCorner().cast<double>();
    instance.T_world_object = T_world_object;
    for (size_t k = 0; k < mesh.triangles.size(); ++k) addTriangle(k);
    scene_.instances.push_back(std::move(instance));
  }

 private:
  void addTriangle(size_t index) {
    const Eigen::Vector3i& corner = mesh_->triangles[index];
    for (int k = 0; k < 3; ++k)
      scene_.indices.push_back(first_corner_ + static_cast<uint32_t>(corner[k]));
    ShadingTriangle t;
    t.instance = static_cast<int>(scene_.instances.size());
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

void buildHierarchies(RenderScene& scene) {
  scene.corners.emplace_back(Vector3f::Zero());  // spare
  const std::span<const Vector3f> corners(scene.corners.data(), scene.corners.size() - 1);
  const std::span<const uint32_t> indices(scene.indices);
  scene.bvh.emplace(corners, indices);
  scene.quick_bvh.emplace(corners, indices, Traversal::kQuick);
  for (SceneInstance& instance : scene.instances)
    if (instance.tracked)
      instance.alone.emplace(
          corners, indices.subspan(3 * instance.first_triangle, 3 * instance.triangle_count));
}

}  // namespace

RenderScene makeRenderScene(const Scene& scene) {
  RenderScene result;
  for (const AreaLight& light : scene.lights) result.lights.push_back(makeLight(light));
  Builder builder(result);
  if (scene.environment_mesh.empty())
    result.instances.emplace_back();
  else
    builder.add(importMesh(scene.environment_mesh), SE3{}, false);
  for (const SceneObject& object : scene.objects)
    builder.add(importMesh(object.mesh, {object.scale, object.y_up}), object.T_world_object,
                object.tracked);
  result.is_lamp.resize(result.triangles.size());
  for (uint32_t k = 0; k < result.triangles.size(); ++k) result.is_lamp[k] = markLamp(result, k);
  const bool emits = std::any_of(result.materials.begin(), result.materials.end(),
                                 [](const ShadingMaterial& m) { return m.emits; });
  const bool dark = result.lights.empty() && !emits && scene.ambient <= 0;
  result.sky.setConstant(dark ? 1.f : static_cast<float>(scene.ambient));
  buildHierarchies(result);
  return result;
}

}  // namespace diorama
