#include "sim/moving_objects.h"

#include <algorithm>
#include <cmath>

#include "sim/plane_depth.h"
#include "sim/shading.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

// Moments of the exposure at which an object's place in the image is looked up.
constexpr int kMoments = 5;

ExposureMotion relativeTo(const ExposureMotion& motion, size_t object) {
  ExposureMotion relative = motion;
  relative.T_world_camera = [motion, object](double offset_s) {
    return motion.T_world_object(object, offset_s).inverse() * motion.T_world_camera(offset_s);
  };
  return relative;
}

}  // namespace

MovingObjects::MovingObjects(std::shared_ptr<const RenderScene> scene, const Camera& camera,
                             const RayTable& table)
    : scene_(std::move(scene)),
      height_(camera.height()),
      tile_boxes_(tileBoxes(table)),
      light_(scene_),
      in_tile_(tile_boxes_.size()) {
  for (const MovingObject& moving : scene_->moving) objects_.push_back({moving.scene.get(), {}, 0});
  for (int tile = 0; tile < table.tileCount(); ++tile)
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketRays& packet = table.packet(tile, p);
      if (packet.valid) pixel_ = std::max(pixel_, packet.pixel);
    }
  for (const DirectionBox& box : tile_boxes_)
    if (box.x0 <= box.x1)
      half_view_rad_ = std::max<double>(
          half_view_rad_, std::atan(std::hypot(std::max(std::abs(box.x0), std::abs(box.x1)),
                                               std::max(std::abs(box.y0), std::abs(box.y1)))));
}

MovingObjects::~MovingObjects() = default;

void MovingObjects::begin(const ExposureMotion& motion, WorkerPool& pool) {
  motions_.clear();
  cameras_.clear();
  for (std::vector<size_t>& tile : in_tile_) tile.clear();
  std::vector<SE3> poses;
  for (size_t k = 0; k < objects_.size(); ++k) {
    const size_t object = scene_->moving[k].object;
    motions_.push_back(relativeTo(motion, object));
    cameras_.emplace_back(motions_.back(), height_);
    poses.push_back(motion.T_world_object(object, 0));
    placeInTiles(k, motions_.back());
  }
  light_.update(poses, viewOf(motion), pool);
}

void MovingObjects::preparePatterns(const std::function<Patterns(const ExposureMotion&)>& make) {
  for (size_t k = 0; k < objects_.size(); ++k) objects_[k].patterns = make(motions_[k]);
}

ViewCone MovingObjects::viewOf(const ExposureMotion& motion) const {
  constexpr double kMargin_rad = 0.1;  // rows and moments beside the middle one look elsewhere
  const SE3 T_world_camera = motion.T_world_camera(0);
  const Matrix3d R = T_world_camera.rotationMatrix();
  return {T_world_camera.translation.cast<float>(), R.col(2).cast<float>(),
          static_cast<float>(std::cos(half_view_rad_ + kMargin_rad))};
}

// Where the object's box is seen at some moments of the exposure, and a little around it.
void MovingObjects::placeInTiles(size_t index, const ExposureMotion& relative) {
  const double first_s = relative.rowOffset_s(0, height_) - relative.exposure_s / 2,
               last_s = relative.rowOffset_s(height_ - 1, height_) + relative.exposure_s / 2;
  const RenderScene& scene = *objects_[index].scene;
  Eigen::AlignedBox3f corners;
  for (size_t k = 0; k + 1 < scene.corners.size(); ++k) corners.extend(scene.corners[k]);
  const Vector3d min = corners.min().cast<double>(), max = corners.max().cast<double>();
  std::array<DirectionBox, kMoments> boxes;
  DirectionBox all;
  for (int k = 0; k < kMoments; ++k) {
    const double moment_s = first_s + (last_s - first_s) * k / (kMoments - 1);
    boxes[static_cast<size_t>(k)] =
        DirectionBox::of(min, max, relative.T_world_camera(moment_s).inverse());
    all.extend(boxes[static_cast<size_t>(k)]);
  }
  const DirectionBox &a = boxes.front(), &b = boxes.back();
  const float way =
      std::max(std::hypot(a.x0 - b.x0, a.y0 - b.y0), std::hypot(a.x1 - b.x1, a.y1 - b.y1));
  objects_[index].way_px = std::isfinite(way) ? static_cast<double>(way / pixel_) : 0;
  const float margin = 2 * pixel_ + (std::isfinite(way) ? way / kMoments : 0);
  all.extend(all.x0 - margin, all.y0 - margin);
  all.extend(all.x1 + margin, all.y1 + margin);
  for (size_t tile = 0; tile < tile_boxes_.size(); ++tile)
    if (tile_boxes_[tile].meets(all)) in_tile_[tile].push_back(index);
}

double MovingObjects::motionInTile(int tile) const {
  double way = 0;
  for (const size_t k : in_tile_[static_cast<size_t>(tile)])
    way = std::max(way, objects_[k].way_px);
  return way;
}

// Gives `take` the hits of each object that are nearer than t, which becomes their distance.
template <class RaysOf, class Take>
void MovingObjects::nearer(int tile, Int8 valid, Float8& t, const RaysOf& rays_of,
                           const Take& take) const {
  for (const size_t k : in_tile_[static_cast<size_t>(tile)]) {
    const RayPacket rays = rays_of(k);
    PacketHits hits = objects_[k].scene->bvh->closest(rays, valid, splat(0.f), true);
    hits.mask &= hits.t < t;
    if (simd::bits(hits.mask) == 0) continue;
    take(k, rays, hits);
    t = simd::select(hits.mask, hits.t, t);
  }
}

void MovingObjects::traceCenters(int tile, const PacketRays& packet, int y, Centers& centers,
                                 Vector8* draft) const {
  const auto rays_of = [&](size_t k) { return cameras_[k].rays(packet, y); };
  const auto take = [&](size_t k, const RayPacket& rays, const PacketHits& hits) {
    const RenderScene& scene = *objects_[k].scene;
    const Float8 depth = PlaneDepth(scene)(cameras_[k][y], cameras_[k][y + 1], packet, hits);
    centers.depth_m = simd::select(hits.mask, depth, centers.depth_m);
    for (int lane = 0; lane < 8; ++lane)
      if (hits.mask[lane])
        centers.id[lane] = scene.triangles[static_cast<size_t>(hits.triangle[lane])].instance;
    centers.mask |= hits.mask;
    if (draft == nullptr) return;
    const Surface surface =
        shading::surfaceOfPixel(scene, light_.of(k), rays, hits, splat(packet.pixel));
    *draft = simd::select(hits.mask, shading::radianceOf(scene, light_.of(k), rays, hits, surface),
                          *draft);
  };
  nearer(tile, simd::maskOfBits(packet.valid), centers.t, rays_of, take);
}

void MovingObjects::drawSample(int tile, const PacketRays& packet, int y,
                               const SampleChoice& choice, Float8 t, Vector8& color) const {
  const auto rows = [&](size_t k) { return objects_[k].patterns[choice.pattern].rows(y); };
  const auto sampleOf = [&](const SamplePattern& pattern) -> const PixelSample& {
    return (choice.extra ? pattern.extra : pattern.base)[choice.index];
  };
  const auto rays_of = [&](size_t k) {
    return raysOf(packet, sampleOf(rows(k).first), sampleOf(rows(k).second));
  };
  const auto take = [&](size_t k, const RayPacket& rays, const PacketHits& hits) {
    const RenderScene& scene = *objects_[k].scene;
    const SamplePattern& pattern = rows(k).first;
    const Surface surface =
        shading::surfaceAt(scene, light_.of(k), rays, hits, splat(packet.pixel * pattern.footprint),
                           splat(sampleOf(pattern).dither));
    color = simd::select(hits.mask, shading::radianceOf(scene, light_.of(k), rays, hits, surface),
                         color);
  };
  nearer(tile, simd::maskOfBits(packet.valid), t, rays_of, take);
}

}  // namespace diorama
