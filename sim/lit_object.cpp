#include "sim/lit_object.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

// An object that fills less of a hemisphere is not looked at.
constexpr float kLeastShare = 0.01f;

Vector8 turned(const Eigen::Matrix3f& R, const Vector8& v) {
  const auto row = [&](int r) { return R(r, 0) * v.x + R(r, 1) * v.y + R(r, 2) * v.z; };
  return {row(0), row(1), row(2)};
}

}  // namespace

// Triangles at even steps of the area, in the order of the mesh.
std::vector<LitObject::Discs> LitObject::makeDiscs(const RenderScene& scene, int count) {
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
  if (!(total > 0)) return {};
  const Discs none{simd::splat3(0, 0, 0), simd::splat3(0, 0, 1), splat(0.f)};
  std::vector<Discs> discs((static_cast<size_t>(count) + 7) / 8, none);
  for (int d = 0; d < count; ++d) {
    const float place = total * (static_cast<float>(d) + 0.5f) / static_cast<float>(count);
    const auto found = std::lower_bound(until.begin(), until.end(), place);
    const auto k = static_cast<uint32_t>(std::min(found, until.end() - 1) - until.begin());
    const auto [e1, e2] = edges(k);
    const Vector3f p = scene.corner(k, 0) + (e1 + e2) / 3, n = e1.cross(e2).normalized();
    Discs& some = discs[static_cast<size_t>(d) / 8];
    const int lane = d % 8;
    some.position.x[lane] = p.x(), some.position.y[lane] = p.y(), some.position.z[lane] = p.z();
    some.normal.x[lane] = n.x(), some.normal.y[lane] = n.y(), some.normal.z[lane] = n.z();
    some.area_m2[lane] = total / static_cast<float>(count);
  }
  return discs;
}

LitObject::LitObject(const RenderScene& s, int discs, const LightMap& like)
    : scene(&s),
      grid(makeLightGrid(s)),
      coarse_grid(makeLightGrid(s, kCoarse)),
      direct(grid.pointCount(), Vector3f::Zero()),
      gathered(coarse_grid.pointCount(), Vector3f::Zero()),
      map{.samples = std::vector<uint32_t>(grid.point_of_sample.size()),
          .bounced = {},
          .max = like.max,
          .typical = like.typical},
      blockers(s),
      discs_(makeDiscs(s, discs)) {
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : grid.positions) box.extend(p);
  if (box.isEmpty()) return;
  center = box.center();
  radius_m = 0.5f * box.diagonal().norm();
}

void LitObject::place(const SE3& T_world_object, const std::vector<RectangleLight>& world_lights) {
  R_world_object = T_world_object.rotationMatrix().cast<float>();
  R_object_world = R_world_object.transpose();
  t_world_object = T_world_object.translation.cast<float>();
  t_object_world = T_world_object.inverse().translation.cast<float>();
  center_world = toWorld(center);
  discs_world_ = discs_;
  for (Discs& some : discs_world_) {
    some.position = turned(R_world_object, some.position) + simd::splat3(t_world_object);
    some.normal = turned(R_world_object, some.normal);
  }
  lights = world_lights;
  for (RectangleLight& light : lights) {
    light.center = R_object_world * light.center + t_object_world;
    for (Vector3f* axis : {&light.axis_u, &light.axis_v, &light.normal})
      *axis = R_object_world * *axis;
  }
}

RayPacket LitObject::inObject(const RayPacket& rays) const {
  return {turned(R_object_world, rays.origin) + simd::splat3(t_object_world),
          turned(R_object_world, rays.direction)};
}

bool LitObject::mayCount(const Vector3f& p, float sphere_radius_m) const {
  const float distance = std::max(0.f, (center_world - p).norm() - sphere_radius_m);
  return radius_m * radius_m >= kLeastShare * distance * distance;
}

float LitObject::share(const Vector3f& p, const Vector3f& n) const {
  const float distance2 = (center_world - p).squaredNorm();
  if (radius_m * radius_m < kLeastShare * distance2 || n.dot(center_world - p) < -radius_m)
    return 0;
  const Vector8 from = simd::splat3(p), up = simd::splat3(n);
  Float8 sum = splat(0.f);
  for (const Discs& some : discs_world_) {
    const Vector8 to = some.position - from;
    const Float8 r2 = dot(to, to), above = dot(up, to), faces = -dot(some.normal, to);
    const Float8 part =
        some.area_m2 * above * faces / (r2 * (std::numbers::pi_v<float> * r2 + some.area_m2));
    sum += simd::select((above > 0.f) & (faces > 0.f), part, splat(0.f));
  }
  return std::min(simd::sum(sum), 1.f);
}

std::vector<uint32_t> LitObject::takeDirect(const std::vector<Vector3f>& coarse, float part) {
  std::vector<uint32_t> uneven;
  std::vector<uint8_t> known(direct.size(), 0);
  for (size_t k = 0; k < grid.resolution.size(); ++k) {
    const int r = grid.resolution[k];
    const float step = 1 / static_cast<float>(r);
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i) {
        const uint32_t p = grid.point(k, i, j);
        if (known[p]) continue;  // on an edge: of another triangle too
        known[p] = 1;
        const float u = static_cast<float>(i) * step, v = static_cast<float>(j) * step;
        direct[p] = coarse_grid.at(k, u, v, coarse);
        const LightGrid::Cell c = coarse_grid.cellAt(k, u, v);
        const Vector3f &a = coarse[c.point[0]], &b = coarse[c.point[1]], &d = coarse[c.point[2]];
        const Vector3f most = a.cwiseMax(b).cwiseMax(d), least = a.cwiseMin(b).cwiseMin(d);
        const float at_corner = *std::max_element(c.weight.begin(), c.weight.end());
        if (at_corner < 0.999f && (most - least).maxCoeff() > part * most.maxCoeff())
          uneven.push_back(p);
      }
  }
  return uneven;
}

void LitObject::publish() {
  for (size_t k = 0; k < grid.resolution.size(); ++k) {
    const int r = grid.resolution[k];
    const float step = 1 / static_cast<float>(r);
    auto s = static_cast<size_t>(grid.offset[k]);
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i, ++s) {
        const Vector3f bounced =
            coarse_grid.at(k, static_cast<float>(i) * step, static_cast<float>(j) * step, gathered);
        map.samples[s] = packLight(direct[grid.point_of_sample[s]] + bounced, map.max);
      }
  }
}

void LitObject::darken() {
  std::fill(direct.begin(), direct.end(), Vector3f::Zero());
  std::fill(gathered.begin(), gathered.end(), Vector3f::Zero());
  std::fill(map.samples.begin(), map.samples.end(), 0u);
}

Int8 hiddenBy(const std::vector<const LitObject*>& objects, const RayPacket& rays, Int8 active,
              Float8 end) {
  Int8 hidden = splat(0);
  for (const LitObject* object : objects)
    hidden |= object->scene->bvh->occluded(object->inObject(rays), active & ~hidden, splat(0.f),
                                           end, true);
  return hidden;
}

}  // namespace diorama
