#include "sim/occlusion_view.h"

#include <algorithm>
#include <limits>

#include "sim/direction_box.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

int count(Int8 mask) { return __builtin_popcount(static_cast<unsigned>(simd::bits(mask))); }

Vector8 turned(const Matrix3d& R, const Vector8& v) {
  return simd::splat3(R.col(0)) * v.x + simd::splat3(R.col(1)) * v.y + simd::splat3(R.col(2)) * v.z;
}

RayPacket inFrame(const SE3& T_world_this, const RayPacket& rays) {
  const SE3 T_this_world = T_world_this.inverse();
  const Matrix3d R = T_this_world.rotationMatrix();
  return {turned(R, rays.origin) + simd::splat3(T_this_world.translation),
          turned(R, rays.direction)};
}

}  // namespace

void TraceableMesh::add(const Mesh& mesh, const SE3& T_this_mesh) {
  const auto first = static_cast<uint32_t>(corners_.size());
  for (const Vector3f& p : mesh.positions)
    corners_.push_back((T_this_mesh * p.cast<double>()).cast<float>());
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) indices_.push_back(first + static_cast<uint32_t>(t[k]));
}

void TraceableMesh::build() {
  if (indices_.empty()) return;
  corners_.emplace_back(Vector3f::Zero());  // spare, see Bvh
  bvh_ = std::make_unique<Bvh>(std::span(corners_).first(corners_.size() - 1), indices_);
}

Int8 TraceableMesh::occluded(const SE3& T_world_this, const RayPacket& rays, Int8 active,
                             Float8 t_max) const {
  if (!bvh_) return splat(0);
  return bvh_->occluded(inFrame(T_world_this, rays), active, splat(0.f), t_max, true);
}

Float8 TraceableMesh::distance(const SE3& T_world_this, const RayPacket& rays, Int8 active) const {
  if (!bvh_) return splat(kInfinity);
  const PacketHits hits = bvh_->closest(inFrame(T_world_this, rays), active, splat(0.f), true);
  return simd::select(hits.mask, hits.t, splat(kInfinity));
}

bool TraceableMesh::cuts(const SE3& T_world_this, const Vector3d& from, const Vector3d& to) const {
  const RayPacket ray{simd::splat3(from), simd::splat3(Vector3d(to - from))};
  return simd::bits(occluded(T_world_this, ray, simd::firstLanes(1), splat(1.f))) != 0;
}

ObjectViewer::ObjectViewer(const Scene& scene, size_t object, const std::vector<Mesh>& meshes,
                           const Mesh* environment)
    : scene_(scene),
      object_(object),
      camera_(scene.camera),
      grid_(camera_),
      low_(meshes[object].minCorner().cast<double>()),
      high_(meshes[object].maxCorner().cast<double>()) {
  target_.add(meshes[object], SE3{});
  if (environment) resting_.add(*environment, SE3{});
  for (size_t i = 0; i < scene.objects.size(); ++i) {
    if (i == object) continue;
    if (!scene.objects[i].path) {
      resting_.add(meshes[i], scene.objects[i].T_world_object);
      continue;
    }
    moving_.push_back({i, {}});
    moving_.back().mesh.add(meshes[i], SE3{});
  }
  target_.build();
  resting_.build();
  for (Moving& moving : moving_) moving.mesh.build();
}

Vector3d ObjectViewer::middle(int frame) const {
  return scene_.objects[object_].pose(scene_.time_s(frame)) * middleInObject();
}

ObjectView ObjectViewer::look(int frame) const {
  const double time_s = scene_.time_s(frame);
  ObjectView view;
  view.T_world_camera = scene_.T_world_camera(frame);
  const SE3 T_camera_object = view.T_world_camera.inverse() * scene_.objects[object_].pose(time_s);
  const DirectionBox box = DirectionBox::of(low_, high_, T_camera_object);
  for (int r = 0; r < grid_.rows(); ++r)
    for (int c = 0; c < grid_.columns(); ++c) {
      DirectionBox cell;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2f& d = grid_.corner(c + (k & 1), r + (k >> 1));
        cell.extend(d.x(), d.y());
      }
      if (!cell.meets(box)) continue;
      for (int row = 0; row < ExtendedGrid::kCell; ++row) lookAlong(c, r, row, time_s, view);
    }
  return view;
}

// The eight pixels of a row of a cell.
void ObjectViewer::lookAlong(int c, int r, int row, double time_s, ObjectView& view) const {
  const int w = camera_.width(), h = camera_.height(), y = grid_.cellY(r) + row;
  if (y >= 2 * h) return;
  const Int8 x = Int8{0, 1, 2, 3, 4, 5, 6, 7} + grid_.cellX(c);
  const auto [dx, dy] = grid_.row(c, r, row);
  const RayPacket rays{simd::splat3(view.T_world_camera.translation),
                       turned(view.T_world_camera.rotationMatrix(), {dx, dy, splat(1.f)})};
  const SE3 T_world_object = scene_.objects[object_].pose(time_s);
  const Float8 t = target_.distance(T_world_object, rays, x < 2 * w);
  Int8 seen = t < kInfinity;
  view.px_all += count(seen);
  seen = seen & (x >= 0) & (x < w) & splat(y >= 0 && y < h ? -1 : 0);
  if (!simd::bits(seen)) return;
  seen = seen & ~resting_.occluded(SE3{}, rays, seen, t);
  for (const Moving& moving : moving_)
    seen = seen & ~moving.mesh.occluded(scene_.objects[moving.object].pose(time_s), rays, seen, t);
  if (!simd::bits(seen)) return;
  view.px_visible += count(seen);
  view.visible.push_back(rays);
  view.lanes.push_back(simd::bits(seen));
}

bool ObjectViewer::meetsScene(int frame, const Vector3d& from, const Vector3d& to) const {
  const double time_s = scene_.time_s(frame);
  if (resting_.cuts(SE3{}, from, to)) return true;
  if (target_.cuts(scene_.objects[object_].pose(time_s), from, to)) return true;
  return std::any_of(moving_.begin(), moving_.end(), [&](const Moving& moving) {
    return moving.mesh.cuts(scene_.objects[moving.object].pose(time_s), from, to);
  });
}

double openFraction(const ObjectView& view, const TraceableMesh& occluder,
                    const SE3& T_world_occluder, size_t step) {
  int seen = 0, open = 0;
  for (size_t i = step / 2; i < view.visible.size(); i += step) {
    Int8 active;
    for (int lane = 0; lane < 8; ++lane) active[lane] = view.lanes[i] >> lane & 1 ? -1 : 0;
    seen += count(active);
    open += count(active &
                  ~occluder.occluded(T_world_occluder, view.visible[i], active, splat(kInfinity)));
  }
  return seen ? view.fraction() * open / seen : 0;
}

}  // namespace diorama
