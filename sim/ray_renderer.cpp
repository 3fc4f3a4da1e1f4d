#include "sim/ray_renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/errors.h"
#include "sim/color_painter.h"
#include "sim/moving_objects.h"
#include "sim/plane_depth.h"
#include "sim/ray_table.h"
#include "sim/row_cameras.h"
#include "sim/sample_candidates.h"
#include "sim/sample_pattern.h"
#include "sim/shading.h"
#include "sim/silhouettes.h"
#include "sim/tile_motion.h"
#include "sim/triangle_tiles.h"
#include "sim/truth_buffer.h"
#include "sim/worker_pool.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

// Pixels whose samples go farther are sampled: the neighbourhood to look at would be too large.
constexpr int kMostReach_px = 12;
constexpr float kCandidateMargin_px = 4;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Samples a pixel, and as many again where they show contrast.
struct SampleCount {
  double most_way_px;  // up to this motion in the image
  PatternOptions standard, high;
};
constexpr std::array<SampleCount, 3> kSampleCounts = {
    {{3.5, {8, 0.5f, 4, 0.6f}, {16, 0.4f, 16, 0.4f}},
     {8, {8, 0.7f, 8, 0.7f}, {16, 0.5f, 16, 0.5f}},
     {1e9, {16, 0.7f, 16, 0.7f}, {32, 0.5f, 32, 0.5f}}}};

// Samples stray from the pixel by half the way and half a pixel. What the last of them meet in the
// outermost part of a pixel hardly counts.
int reachOf(double way_px) {
  constexpr double kUncounted_px = 0.3;
  return static_cast<int>(std::ceil(std::min(way_px / 2 + 0.5 - kUncounted_px, 99.0)));
}

size_t patternFor(double way_px) {
  return way_px < kSampleCounts[0].most_way_px ? 0 : way_px < kSampleCounts[1].most_way_px ? 1 : 2;
}

}  // namespace

struct RayRenderer::State {
  State(std::shared_ptr<const RenderScene> s, Camera c, RenderOptions o)
      : scene(std::move(s)),
        camera(std::move(c)),
        options(o),
        table(camera),
        pool(o.threads),
        silhouettes(*scene, camera, table),
        triangles(*scene, table, draft() ? 0 : kCandidateMargin_px),
        truth(table.paddedWidth(), table.paddedHeight()),
        motions(static_cast<size_t>(table.tileCount())) {
    if (!scene->moving.empty()) moving.emplace(scene, camera, table);
  }

  bool draft() const { return options.quality == RenderQuality::kDraft; }
  bool movingIn(int tile) const { return moving && moving->inTile(tile); }
  LightView light() const { return moving ? moving->lightAround() : scene->lightView(); }
  ColorPainter painter() const { return {*scene, light(), brightest}; }

  void traceTile(int tile, const RowCameras& cameras, const ExposureMotion& motion,
                 Image<Radiance>& radiance);
  void traceCenters(int tile, const RowCameras& cameras, TileHits& hits) const;
  void keepTruth(int tile, int p, const RowCameras& cameras, const PacketHits& hits,
                 PlaneDepth& planeDepth, Vector8* color);
  void drawSharp(int tile, const RowCameras& cameras, const TileHits& hits,
                 Image<Radiance>& radiance);
  void drawSmooth(int tile, const RowCameras& cameras, const TileHits& hits,
                  Image<Radiance>& radiance) const;
  void refineColors(int tile, Image<Radiance>& radiance) const;
  RoughPixels roughPixels(int tile, const TileMotion& motion) const;
  void drawAmongMoving(int tile, size_t choice, Image<Radiance>& radiance) const;
  Vector8 colorAmongMoving(int tile, const PacketRays& packet, int y, size_t choice,
                           bool edge) const;
  void preparePatterns(const ExposureMotion& motion);
  double strayOf(const CameraFrame& camera) const;

  std::shared_ptr<const RenderScene> scene;
  Camera camera;
  RenderOptions options;
  RayTable table;
  WorkerPool pool;
  SilhouetteTracer silhouettes;
  TriangleTiles triangles;
  TruthBuffer truth;
  Patterns patterns;
  std::vector<TileMotion> motions;
  std::optional<MovingObjects> moving;
  float brightest = 0;
  bool rolling = false;
};

RayRenderer::RayRenderer(std::shared_ptr<const RenderScene> scene, Camera camera,
                         RenderOptions options)
    : state_(std::make_unique<State>(std::move(scene), std::move(camera), options)) {}
RayRenderer::~RayRenderer() = default;

RenderedFrame RayRenderer::render(const ExposureMotion& motion) const {
  State& s = *state_;
  RenderedFrame frame;
  frame.radiance = Image<Radiance>(s.camera.width(), s.camera.height());
  const RowCameras cameras(motion, s.camera.height());
  if (s.moving) s.moving->begin(motion, s.pool);
  s.preparePatterns(motion);
  s.rolling = cameras.rolling();
  if (!s.rolling) s.triangles.sort(cameras[0], s.pool, s.strayOf(cameras[0]));
  s.pool.run(s.table.tileCount(),
             [&](int tile) { s.traceTile(tile, cameras, motion, frame.radiance); });
  if (!s.draft())
    s.pool.run(s.table.tileCount(), [&](int tile) { s.refineColors(tile, frame.radiance); });
  frame.silhouettes = s.silhouettes.trace(
      cameras, s.moving ? s.moving->cameras() : std::span<const RowCameras>{}, s.truth, s.pool);
  s.truth.copyTo(frame, s.camera.width(), s.camera.height());
  return frame;
}

namespace {

void put(const Vector8& color, const PacketRays& packet, int x, int y, Image<Radiance>& radiance) {
  if (packet.valid == 0xff)
    return simd::storeFours(&radiance(x, y).r, &radiance(x, y + 1).r, color);
  for (int lane = 0; lane < 8; ++lane)
    if (packet.valid >> lane & 1)
      radiance(x + laneX(lane), y + laneY(lane)) = {color.x[lane], color.y[lane], color.z[lane]};
}

}  // namespace

// Truth at the pixel centres, and colours that hold in draft quality, or where the image is smooth.
void RayRenderer::State::traceTile(int tile, const RowCameras& cameras,
                                   const ExposureMotion& motion, Image<Radiance>& radiance) {
  TileHits hits;
  traceCenters(tile, cameras, hits);
  if (draft()) return drawSharp(tile, cameras, hits, radiance);
  PlaneDepth planeDepth(*scene);
  for (int p = 0; p < kPacketsPerTile; ++p)
    keepTruth(tile, p, cameras, hits[static_cast<size_t>(p)], planeDepth, nullptr);
  TileMotion& there = motions[static_cast<size_t>(tile)];
  there = motionInTile(tile, motion, camera.height(), table, truth);
  if (moving) there.way = std::max(there.way, moving->motionInTile(tile));
  if (!movingIn(tile)) drawSmooth(tile, cameras, hits, radiance);
}

// Rays through the pixel centres; where every row has a camera of its own they are traced, those of
// 4 x 4 pixels together.
void RayRenderer::State::traceCenters(int tile, const RowCameras& cameras, TileHits& hits) const {
  if (!cameras.rolling()) return triangles.meet(tile, hits);
  for (int pair = 0; pair < kPacketsPerTile / 2; ++pair) {
    const int upper = pair / kPacketsPerRow * 2 * kPacketsPerRow + pair % kPacketsPerRow;
    std::array<RayPacket, 2> rays;
    std::array<Int8, 2> valid;
    for (int k = 0; k < 2; ++k) {
      const int p = upper + k * kPacketsPerRow;
      const PacketRays& packet = table.packet(tile, p);
      rays[static_cast<size_t>(k)] = cameras.rays(packet, table.packetY(tile, p));
      valid[static_cast<size_t>(k)] = simd::maskOfBits(packet.valid);
    }
    const std::array<PacketHits, 2> both = scene->bvh->closestOfPair(rays, valid);
    hits[static_cast<size_t>(upper)] = both[0];
    hits[static_cast<size_t>(upper + kPacketsPerRow)] = both[1];
  }
}

// Where things move by themselves, a colour is theirs when they are nearer.
void RayRenderer::State::keepTruth(int tile, int p, const RowCameras& cameras,
                                   const PacketHits& hits, PlaneDepth& planeDepth, Vector8* color) {
  const PacketRays& packet = table.packet(tile, p);
  const int x = table.packetX(tile, p), y = table.packetY(tile, p);
  Float8 depth = simd::select(hits.mask, hits.t, splat(0.f));
  if (rolling) depth = planeDepth(cameras[y], cameras[y + 1], packet, hits);
  Int8 id = splat(0);
  Int8 patch = simd::select(simd::maskOfBits(packet.valid), splat(TruthBuffer::kNothing),
                            splat(TruthBuffer::kUnknown));
  for (auto pending = static_cast<unsigned>(simd::bits(hits.mask)); pending != 0;) {
    const int number = hits.triangle[__builtin_ctz(pending)];
    const ShadingTriangle& triangle = scene->triangles[static_cast<size_t>(number)];
    const Int8 lanes = hits.mask & (hits.triangle == splat(number));
    id = simd::select(lanes, splat(triangle.instance), id);
    patch = simd::select(lanes, splat(triangle.patch), patch);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
  if (movingIn(tile)) {
    MovingObjects::Centers nearest{simd::select(hits.mask, hits.t, splat(kInfinity)), depth, id,
                                   splat(0)};
    moving->traceCenters(tile, packet, y, nearest, color);
    depth = nearest.depth_m;
    id = nearest.id;
    patch = simd::select(nearest.mask, splat(TruthBuffer::kUnknown), patch);
  }
  truth.put(x, y, depth, id, patch);
}

namespace {

// Draws the packets of a tile, each looked up while the one before is drawn.
template <class Look, class Draw>
void drawAhead(const Look& look, const Draw& draw) {
  std::array<Sight, 2> sights;
  const auto of = [&](int p) -> Sight& { return sights[static_cast<size_t>(p & 1)]; };
  look(0, of(0));
  for (int p = 0; p < kPacketsPerTile; ++p) {
    if (p + 1 < kPacketsPerTile) look(p + 1, of(p + 1));
    draw(p, of(p));
  }
}

}  // namespace

void RayRenderer::State::drawSharp(int tile, const RowCameras& cameras, const TileHits& hits,
                                   Image<Radiance>& radiance) {
  const ColorPainter paint = painter();
  PlaneDepth planeDepth(*scene);
  const auto look = [&](int p, Sight& sight) {
    const PacketRays& packet = table.packet(tile, p);
    paint.look(packet, cameras.rays(packet, table.packetY(tile, p)), hits[static_cast<size_t>(p)],
               sight);
  };
  drawAhead(look, [&](int p, const Sight& sight) {
    const PacketRays& packet = table.packet(tile, p);
    Vector8 color = paint.sharp(packet, sight);
    keepTruth(tile, p, cameras, sight.hits, planeDepth, &color);
    put(color, packet, table.packetX(tile, p), table.packetY(tile, p), radiance);
  });
}

void RayRenderer::State::drawSmooth(int tile, const RowCameras& cameras, const TileHits& hits,
                                    Image<Radiance>& radiance) const {
  const ColorPainter paint = painter();
  const MovingPattern& pattern = patterns[patternFor(motions[static_cast<size_t>(tile)].way)];
  const auto look = [&](int p, Sight& sight) {
    const PacketRays& packet = table.packet(tile, p);
    paint.look(packet, cameras.rays(packet, table.packetY(tile, p)), hits[static_cast<size_t>(p)],
               pattern[0].tap_footprint, sight);
  };
  drawAhead(look, [&](int p, const Sight& sight) {
    const PacketRays& packet = table.packet(tile, p);
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    put(paint.smooth(packet, sight, pattern.rows(y)), packet, x, y, radiance);
  });
}

void RayRenderer::State::preparePatterns(const ExposureMotion& motion) {
  brightest = motion.brightest;
  if (draft()) return;
  const auto make = [&](const ExposureMotion& relative) {
    Patterns result;
    for (size_t k = 0; k < result.size(); ++k) {
      const SampleCount& choice = kSampleCounts[k];
      const bool high = options.quality == RenderQuality::kHigh;
      result[k] =
          MovingPattern(high ? choice.high : choice.standard, relative, camera.height(), pool);
    }
    return result;
  };
  patterns = make(motion);
  if (moving) moving->preparePatterns(make);
}

// How far from a camera samples start.
double RayRenderer::State::strayOf(const CameraFrame& middle) const {
  if (draft()) return 0;
  double stray = 0;
  for (const MovingPattern& pattern : patterns)
    stray = std::max(stray, pattern.farthest(middle.origin));
  constexpr double kRounding_m = 1e-5;
  return stray + kRounding_m;
}

// Tiles in which something moves by itself, and pixels near outlines, creases and seams.
void RayRenderer::State::refineColors(int tile, Image<Radiance>& radiance) const {
  const TileMotion& there = motions[static_cast<size_t>(tile)];
  const size_t choice = patternFor(there.way);
  if (movingIn(tile)) return drawAmongMoving(tile, choice, radiance);
  const RoughPixels rough = roughPixels(tile, there);
  if (std::all_of(rough.begin(), rough.end(), [](int lanes) { return lanes == 0; })) return;
  SampleCandidates candidates(*scene, table, triangles);
  if (!rolling) candidates.gather(tile, there, rough, truth);
  const ColorPainter paint = painter();
  for (int p = 0; p < kPacketsPerTile; ++p) {
    const int lanes = rough[static_cast<size_t>(p)];
    if (lanes == 0) continue;
    const PacketRays& packet = table.packet(tile, p);
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    candidates.choose(p, lanes);
    for (int lane = 0; lane < 8; ++lane)
      if (lanes >> lane & 1)
        radiance(x + laneX(lane), y + laneY(lane)) =
            paint.sampled(packet, static_cast<size_t>(lane), patterns[choice][y + laneY(lane)],
                          candidates.of(lane));
  }
}

RoughPixels RayRenderer::State::roughPixels(int tile, const TileMotion& motion) const {
  const Reach reach{reachOf(motion.x), reachOf(motion.y)};
  const bool near = std::max(reach.x, reach.y) <= kMostReach_px;
  RoughPixels rough{};
  for (int p = 0; p < kPacketsPerTile; ++p) {
    int lanes = table.packet(tile, p).valid;
    if (lanes != 0 && near)
      lanes &= truth.roughPixels(table.packetX(tile, p), table.packetY(tile, p), reach,
                                 camera.width(), camera.height());
    rough[static_cast<size_t>(p)] = lanes;
  }
  return rough;
}

void RayRenderer::State::drawAmongMoving(int tile, size_t choice, Image<Radiance>& radiance) const {
  for (int p = 0; p < kPacketsPerTile; ++p) {
    const PacketRays& packet = table.packet(tile, p);
    if (packet.valid == 0) continue;
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    const bool edge = truth.hasEdge(x, y, camera.width(), camera.height());
    put(colorAmongMoving(tile, packet, y, choice, edge), packet, x, y, radiance);
  }
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
        const Surface surface = shading::surfaceAt(
            *scene, light(), rays, hits, splat(packet.pixel * first.footprint), splat(a[k].dither));
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
