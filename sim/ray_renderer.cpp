#include "sim/ray_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/errors.h"
#include "sim/moving_objects.h"
#include "sim/plane_depth.h"
#include "sim/ray_table.h"
#include "sim/row_cameras.h"
#include "sim/sample_pattern.h"
#include "sim/shading.h"
#include "sim/silhouettes.h"
#include "sim/truth_buffer.h"
#include "sim/worker_pool.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

// Samples that go farther are traced: the neighbourhood to look at would be too large.
constexpr double kMostStray_px = 10;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

}  // namespace

struct RayRenderer::State {
  State(std::shared_ptr<const RenderScene> s, Camera c, RenderOptions o)
      : scene(std::move(s)),
        camera(std::move(c)),
        options(o),
        table(camera),
        pool(o.threads),
        silhouettes(*scene, camera, table),
        truth(table.paddedWidth(), table.paddedHeight()) {
    if (!scene->moving.empty()) moving.emplace(scene, camera, table);
  }

  bool movingIn(int tile) const { return moving && moving->inTile(tile); }
  LightView light() const { return moving ? moving->lightAround() : scene->lightView(); }

  void traceCenters(int tile, const RowCameras& cameras, Image<Radiance>* draft);
  void traceColors(int tile, const ExposureMotion& motion, Image<Radiance>& radiance) const;
  Vector8 colorPacket(const PacketRays& packet, const PatternRows& pattern, bool edge,
                      const std::optional<VisibleTriangles>& around) const;
  Vector8 colorOfTriangle(const PacketRays& packet, const PatternRows& pattern,
                          uint32_t triangle) const;
  Vector8 colorAmongMoving(int tile, const PacketRays& packet, int y, size_t choice,
                           bool edge) const;
  double motionInTile(int tile, const ExposureMotion& motion) const;
  void preparePatterns(const ExposureMotion& motion);

  std::shared_ptr<const RenderScene> scene;
  Camera camera;
  RenderOptions options;
  RayTable table;
  WorkerPool pool;
  SilhouetteTracer silhouettes;
  TruthBuffer truth;
  Patterns patterns;
  std::optional<MovingObjects> moving;
  float brightest = 0;
};

RayRenderer::RayRenderer(std::shared_ptr<const RenderScene> scene, Camera camera,
                         RenderOptions options)
    : state_(std::make_unique<State>(std::move(scene), std::move(camera), options)) {}
RayRenderer::~RayRenderer() = default;

RenderedFrame RayRenderer::render(const ExposureMotion& motion) const {
  State& s = *state_;
  RenderedFrame frame;
  frame.radiance = Image<Radiance>(s.camera.width(), s.camera.height());
  const bool draft = s.options.quality == RenderQuality::kDraft;
  const RowCameras cameras(motion, s.camera.height());
  if (s.moving) s.moving->begin(motion, s.pool);
  s.pool.run(s.table.tileCount(),
             [&](int tile) { s.traceCenters(tile, cameras, draft ? &frame.radiance : nullptr); });
  if (!draft) {
    s.preparePatterns(motion);
    s.pool.run(s.table.tileCount(), [&](int tile) { s.traceColors(tile, motion, frame.radiance); });
  }
  frame.silhouettes = s.silhouettes.trace(
      cameras, s.moving ? s.moving->cameras() : std::span<const RowCameras>{}, s.truth, s.pool);
  s.truth.copyTo(frame, s.camera.width(), s.camera.height());
  return frame;
}

void RayRenderer::State::traceCenters(int tile, const RowCameras& cameras, Image<Radiance>* draft) {
  PlaneDepth planeDepth(*scene);
  for (int p = 0; p < kPacketsPerTile; ++p) {
    const PacketRays& packet = table.packet(tile, p);
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    const RayPacket rays = cameras.rays(packet, y);
    const Int8 valid = simd::maskOfBits(packet.valid);
    const PacketHits hits = scene->bvh->closest(rays, valid, splat(0.f), true);
    Float8 depth = splat(0.f);
    Int8 id = splat(0);
    for (int lane = 0; lane < 8; ++lane) {
      if (!hits.mask[lane]) continue;
      const auto triangle = static_cast<uint32_t>(hits.triangle[lane]);
      depth[lane] = planeDepth(cameras[y + laneY(lane)], triangle, packet.x[lane], packet.y[lane],
                               hits.t[lane]);
      id[lane] = scene->triangles[triangle].instance;
    }
    Vector8 color = simd::splat3(scene->sky);
    if (draft != nullptr && simd::bits(hits.mask)) {
      const Surface surface =
          shading::surfaceAt<2>(*scene, light(), rays, hits, splat(packet.pixel), 0.25f);
      color = shading::radianceOf(*scene, light(), rays, hits, surface);
    }
    Int8 resting = hits.mask;
    if (movingIn(tile)) {
      MovingObjects::Centers centers{simd::select(hits.mask, hits.t, splat(kInfinity)), depth, id,
                                     splat(0)};
      moving->traceCenters(tile, packet, y, centers, draft == nullptr ? nullptr : &color);
      depth = centers.depth_m;
      id = centers.id;
      resting &= ~centers.mask;
    }
    truth.put(x, y, depth, id, simd::select(resting, hits.triangle, splat(-1)), valid);
    if (draft == nullptr || packet.valid == 0) continue;
    for (int lane = 0; lane < 8; ++lane)
      if (packet.valid >> lane & 1)
        (*draft)(x + laneX(lane), y + laneY(lane)) = {color.x[lane], color.y[lane], color.z[lane]};
  }
}

void RayRenderer::State::preparePatterns(const ExposureMotion& motion) {
  const bool high = options.quality == RenderQuality::kHigh;
  const auto make = [&](const ExposureMotion& relative) {
    Patterns result;
    for (size_t k = 0; k < result.size(); ++k) {
      const int count = 4 << k;
      result[k] = MovingPattern(high ? std::max(16, 2 * count) : count,
                                high ? count < 16 : count == 4, relative, camera.height(), pool);
    }
    return result;
  };
  patterns = make(motion);
  if (moving) moving->preparePatterns(make);
  brightest = motion.brightest;
}

// The longest way, in pixels, that nine points of the tile go in the image during the exposure.
double RayRenderer::State::motionInTile(int tile, const ExposureMotion& motion) const {
  if (motion.exposure_s == 0) return 0;
  const double middle_s =
      motion.rowOffset_s(table.packetY(tile, kPacketsPerTile / 2), camera.height());
  const SE3 middle = motion.T_world_camera(middle_s);
  const SE3 T_begin_middle =
      motion.T_world_camera(middle_s - motion.exposure_s / 2).inverse() * middle;
  const SE3 T_end_middle =
      motion.T_world_camera(middle_s + motion.exposure_s / 2).inverse() * middle;
  double longest = 0;
  for (int k = 0; k < 9; ++k) {
    const int p = (k / 3) * 60 + (k % 3) * 3;  // packets at the corners, sides and middle
    const PacketRays& packet = table.packet(tile, std::min(p, kPacketsPerTile - 1));
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    if (!(packet.valid & 1)) continue;
    const float depth = truth.depth(x, y);
    const double z = depth > 0 ? static_cast<double>(depth) : 1e3;
    const Vector3d point =
        z * Vector3d(static_cast<double>(packet.x[0]), static_cast<double>(packet.y[0]), 1);
    const Vector3d a = T_begin_middle * point, b = T_end_middle * point;
    if (a.z() < 1e-3 || b.z() < 1e-3) return 1e9;
    const Vector2d way = a.head<2>() / a.z() - b.head<2>() / b.z();
    longest = std::max(longest, way.norm() / static_cast<double>(packet.pixel));
  }
  return longest;
}

void RayRenderer::State::traceColors(int tile, const ExposureMotion& motion,
                                     Image<Radiance>& radiance) const {
  const double way = std::max(motionInTile(tile, motion), moving ? moving->motionInTile(tile) : 0);
  const size_t choice = way < 3.5 ? 0 : way < 8 ? 1 : 2;
  const MovingPattern& pattern = patterns[choice];
  // Samples stray from the pixel by half the way and half a pixel.
  const double stray = way / 2 + 0.51;
  const int columns = static_cast<int>(std::ceil(std::min(stray, 99.0) / kPacketWidth)),
            rows = static_cast<int>(std::ceil(std::min(stray, 99.0) / kPacketHeight));
  for (int p = 0; p < kPacketsPerTile; ++p) {
    const PacketRays& packet = table.packet(tile, p);
    if (packet.valid == 0) continue;
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    std::optional<VisibleTriangles> around;
    if (stray < kMostStray_px) around = truth.trianglesAround(x, y, columns, rows);
    const bool edge = truth.hasEdge(x, y, camera.width(), camera.height());
    Vector8 color;
    if (movingIn(tile))
      color = colorAmongMoving(tile, packet, y, choice, edge);
    else if (around && around->count == 1 && !around->nothing)
      color = colorOfTriangle(packet, pattern.rows(y), static_cast<uint32_t>(around->triangle[0]));
    else
      color = colorPacket(packet, pattern.rows(y), edge, around);
    for (int lane = 0; lane < 8; ++lane)
      if (packet.valid >> lane & 1)
        radiance(x + laneX(lane), y + laneY(lane)) = {color.x[lane], color.y[lane], color.z[lane]};
  }
}

namespace {

// The nearest hits of a packet's samples. Where the pixels around show but a few triangles, these
// are tried first; a ray that misses them all is traced.
class ClosestHits {
 public:
  ClosestHits(const RenderScene& scene, const std::optional<VisibleTriangles>& around, Int8 active)
      : scene_(scene), active_(active) {
    if (!around) return;
    count_ = around->count;
    may_miss_ = around->nothing;
    for (int k = 0; k < count_; ++k)
      triangles_[static_cast<size_t>(k)] = shading::SingleTriangle(
          scene, static_cast<uint32_t>(around->triangle[static_cast<size_t>(k)]));
  }

  PacketHits operator()(const RayPacket& rays) const {
    if (count_ > 0) {
      PacketHits hits;
      hits.t = splat(std::numeric_limits<float>::infinity());
      hits.u = hits.v = splat(0.f);
      hits.normal = simd::splat3(0, 0, 1);
      hits.triangle = hits.mask = splat(0);
      for (int k = 0; k < count_; ++k)
        triangles_[static_cast<size_t>(k)].merge(rays, active_, hits);
      if (may_miss_ || simd::bits(active_ & ~hits.mask) == 0) return hits;
    }
    return scene_.quick_bvh->closest(rays, active_, splat(0.f), true);
  }

 private:
  const RenderScene& scene_;
  Int8 active_;
  int count_ = 0;
  bool may_miss_ = false;
  std::array<shading::SingleTriangle, VisibleTriangles::kMost> triangles_;
};

}  // namespace

Vector8 RayRenderer::State::colorPacket(const PacketRays& packet, const PatternRows& pattern,
                                        bool edge,
                                        const std::optional<VisibleTriangles>& around) const {
  const Int8 valid = simd::maskOfBits(packet.valid);
  const Float8 pixel = splat(packet.pixel * pattern.first.footprint);
  const float step = 1.f / static_cast<float>(pattern.first.base.size());
  const ClosestHits closest(*scene, around, valid);
  Vector8 sum = simd::splat3(0, 0, 0);
  Float8 darkest = splat(1e30f), lightest = splat(0.f);
  const auto add = [&](const PixelSample& sample, const PixelSample& second) {
    const RayPacket rays = raysOf(packet, sample, second);
    const PacketHits hits = closest(rays);
    Vector8 color = simd::splat3(scene->sky);
    if (simd::bits(hits.mask)) {
      const Surface surface =
          shading::surfaceAt<1>(*scene, light(), rays, hits, pixel, sample.dither);
      color = shading::radianceOf(*scene, light(), rays, hits, surface);
    }
    color = simd::min(color, splat(brightest));
    sum = sum + color;
    darkest = simd::min(darkest, color.x + color.y + color.z);
    lightest = simd::max(lightest, color.x + color.y + color.z);
  };
  for (size_t k = 0; k < pattern.first.base.size(); ++k)
    add(pattern.first.base[k], pattern.second.base[k]);
  // Four samples show a contrast c with an error of about c / 8: below 1% of the light extra ones
  // gain nothing that noise would not cover.
  const Int8 contrast = lightest - darkest > 0.08f * lightest;
  if (!edge || pattern.first.extra.empty() || !simd::bits(contrast & valid))
    return sum * splat(step);
  for (size_t k = 0; k < pattern.first.extra.size(); ++k)
    add(pattern.first.extra[k], pattern.second.extra[k]);
  return sum * splat(0.5f * step);
}

Vector8 RayRenderer::State::colorOfTriangle(const PacketRays& packet, const PatternRows& pattern,
                                            uint32_t triangle) const {
  const Int8 valid = simd::maskOfBits(packet.valid);
  const Float8 pixel = splat(packet.pixel * pattern.first.footprint);
  const float step = 1.f / static_cast<float>(pattern.first.base.size());
  const shading::SingleTriangle plane(*scene, triangle);
  TriangleLanes data;
  shading::spread(*scene, static_cast<int>(triangle), data);
  Vector8 sum = simd::splat3(0, 0, 0);
  for (size_t k = 0; k < pattern.first.base.size(); ++k) {
    const PixelSample& sample = pattern.first.base[k];
    const RayPacket rays = raysOf(packet, sample, pattern.second.base[k]);
    const PacketHits hits = plane.plane(rays, valid);
    const Surface surface =
        shading::surfaceAt<1>(*scene, light(), data, rays, hits, pixel, sample.dither);
    sum = sum +
          simd::min(shading::radianceOf(*scene, light(), rays, hits, surface), splat(brightest));
  }
  return sum * splat(step);
}

// Where moving objects may be, every sample is traced.
Vector8 RayRenderer::State::colorAmongMoving(int tile, const PacketRays& packet, int y,
                                             size_t choice, bool edge) const {
  const Int8 valid = simd::maskOfBits(packet.valid);
  const PatternRows rows = patterns[choice].rows(y);
  Vector8 sum = simd::splat3(0, 0, 0);
  const auto add = [&](const SamplePattern& first, const SamplePattern& second, bool extra) {
    const std::vector<PixelSample>&a = extra ? first.extra : first.base,
          &b = extra ? second.extra : second.base;
    for (size_t k = 0; k < a.size(); ++k) {
      const RayPacket rays = raysOf(packet, a[k], b[k]);
      const PacketHits hits = scene->quick_bvh->closest(rays, valid, splat(0.f), true);
      Vector8 color = simd::splat3(scene->sky);
      if (simd::bits(hits.mask)) {
        const Surface surface = shading::surfaceAt<1>(
            *scene, light(), rays, hits, splat(packet.pixel * first.footprint), a[k].dither);
        color = shading::radianceOf(*scene, light(), rays, hits, surface);
      }
      moving->drawSample(tile, packet, y, {choice, extra, k},
                         simd::select(hits.mask, hits.t, splat(kInfinity)), color);
      sum = sum + simd::min(color, splat(brightest));
    }
  };
  add(rows.first, rows.second, false);
  const auto count = static_cast<float>(rows.first.base.size());
  if (!edge || rows.first.extra.empty()) return sum * splat(1 / count);
  add(rows.first, rows.second, true);
  return sum * splat(0.5f / count);
}

}  // namespace diorama
