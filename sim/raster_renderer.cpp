#include "sim/raster_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "core/errors.h"
#include "sim/candidate_triangles.h"
#include "sim/moving_objects.h"
#include "sim/narrow_triangles.h"
#include "sim/plane_depth.h"
#include "sim/ray_table.h"
#include "sim/row_cameras.h"
#include "sim/silhouettes.h"
#include "sim/subframe.h"
#include "sim/tile_motion.h"
#include "sim/triangle_raster.h"
#include "sim/truth_buffer.h"
#include "sim/view_painter.h"
#include "sim/wide_views.h"
#include "sim/worker_pool.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What a quality costs: pixels of the view per camera pixel and axis, and sub-frames of blur.
struct Effort {
  int scale;
  double step_px;  // image motion between two sub-frames
  int most_subframes;
};
Effort effortOf(RenderQuality quality) {
  switch (quality) {
    case RenderQuality::kDraft:
      return {1, 1, 1};
    case RenderQuality::kStandard:
      return {2, 1.5, 8};
    case RenderQuality::kHigh:
      return {3, 0.75, 32};
  }
  DIORAMA_CHECK(!"a quality");
}

// What rests in the world, and each moving object in its own frame.
std::vector<const RenderScene*> layersOf(const RenderScene& scene) {
  std::vector<const RenderScene*> layers = {&scene};
  for (const MovingObject& moving : scene.moving) layers.push_back(moving.scene.get());
  return layers;
}

}  // namespace

struct RasterRenderer::State {
  State(std::shared_ptr<const RenderScene> s, Camera c, RenderOptions o)
      : scene(std::move(s)),
        camera(std::move(c)),
        effort(effortOf(o.quality)),
        table(camera),
        pool(o.threads),
        silhouettes(*scene, camera, table),
        truth(table.paddedWidth(), table.paddedHeight()),
        wide(camera, table, effort.scale),
        layers(layersOf(*scene)),
        raster(layers, mostOf(&PinholeView::width), mostOf(&PinholeView::height)),
        ids(wide.views().size()),
        narrow(wide.views().size()),
        colors(wide.views().size()) {
    if (!scene->moving.empty()) moving.emplace(scene, camera, table);
  }

  int mostOf(int PinholeView::*side) const {
    int most = 1;
    for (const WideView& view : wide.views()) most = std::max(most, view.pinhole.*side);
    return most;
  }
  void drawIds(const Subframe& subframe);
  void markNarrow(const Subframe& subframe);
  void findTruth(int tile, const CameraFrame& frame);
  Int8 takeCandidates(const PacketRays& packet, int x, int y, const SE3& T_camera_world,
                      MovingObjects::Centers& centers) const;
  void traceMissed(int tile, const PacketRays& packet, int y, const CameraFrame& frame, Int8 missed,
                   MovingObjects::Centers& centers) const;
  CandidateTriangles candidatesAround(int x, int y, int valid) const;
  bool mayHideNarrow(int x, int y) const;
  int subframeCount(const ExposureMotion& motion) const;
  void addColors(const Subframe& subframe, float brightest);

  std::shared_ptr<const RenderScene> scene;
  Camera camera;
  Effort effort;
  RayTable table;
  WorkerPool pool;
  SilhouetteTracer silhouettes;
  TruthBuffer truth;
  WideViews wide;
  std::vector<const RenderScene*> layers;
  TriangleRaster raster;
  std::optional<MovingObjects> moving;
  std::vector<std::vector<uint32_t>> ids;        // per view
  std::vector<std::vector<uint8_t>> narrow;      // per view: what the ids may not show
  std::vector<std::vector<LinearColor>> colors;  // per view
};

RasterRenderer::RasterRenderer(std::shared_ptr<const RenderScene> scene, Camera camera,
                               RenderOptions options)
    : state_(std::make_unique<State>(std::move(scene), std::move(camera), options)) {}
RasterRenderer::~RasterRenderer() = default;

RenderedFrame RasterRenderer::render(const ExposureMotion& motion) const {
  if (motion.row_time_s != 0)
    throw Error(kExitBadData, "the raster renderer has no rolling shutter; use --renderer ray");
  State& s = *state_;
  const RowCameras cameras(motion, s.camera.height());
  if (s.moving) s.moving->begin(motion, s.pool);
  const Subframe middle = subframeAt(*s.scene, motion, 0);
  s.drawIds(middle);
  s.markNarrow(middle);
  s.pool.run(s.table.tileCount(), [&](int tile) { s.findTruth(tile, cameras[0]); });

  for (size_t v = 0; v < s.colors.size(); ++v) s.colors[v].assign(s.ids[v].size(), LinearColor{});
  const int count = s.subframeCount(motion);
  for (int k = 0; k < count && count > 1; ++k) {
    const Subframe subframe = subframeOf(*s.scene, motion, k, count);
    s.drawIds(subframe);
    s.addColors(subframe, motion.brightest);
  }
  if (count == 1) s.addColors(middle, motion.brightest);
  RenderedFrame frame;
  frame.radiance = Image<Radiance>(s.camera.width(), s.camera.height());
  s.pool.run(s.camera.height(), [&](int y) {
    for (int x = 0; x < s.camera.width(); ++x) frame.radiance(x, y) = s.wide.mean(x, y, s.colors);
  });
  frame.silhouettes = s.silhouettes.trace(
      cameras, s.moving ? s.moving->cameras() : std::span<const RowCameras>{}, s.truth, s.pool);
  s.truth.copyTo(frame, s.camera.width(), s.camera.height());
  return frame;
}

void RasterRenderer::State::drawIds(const Subframe& subframe) {
  for (size_t v = 0; v < ids.size(); ++v) {
    PinholeView pinhole = wide.views()[v].pinhole;
    pinhole.cx -= subframe.shift_px.x();
    pinhole.cy -= subframe.shift_px.y();
    raster.draw(pinhole, posesIn(wide.views()[v], subframe), ids[v]);
  }
}

void RasterRenderer::State::markNarrow(const Subframe& subframe) {
  pool.run(static_cast<int>(narrow.size()), [&](int v) {
    const WideView& view = wide.views()[static_cast<size_t>(v)];
    std::vector<uint8_t>& marks = narrow[static_cast<size_t>(v)];
    marks.assign(ids[static_cast<size_t>(v)].size(), 0);
    const std::vector<SE3> T_view_layer = posesIn(view, subframe);
    for (size_t k = 0; k < layers.size(); ++k)
      markNarrowTriangles(*layers[k], T_view_layer[k], view.pinhole, marks);
  });
}

CandidateTriangles RasterRenderer::State::candidatesAround(int x, int y, int valid) const {
  CandidateTriangles candidates;
  for (int lane = 0; lane < 8; ++lane) {
    if (!(valid >> lane & 1)) continue;
    const PlacedPixel& pixel = wide.placed(x + laneX(lane), y + laneY(lane));
    const auto view = static_cast<size_t>(pixel.view);
    const int stride = wide.views()[view].pinhole.width;
    const auto column = std::lround(pixel.x), row = std::lround(pixel.y);
    for (auto r = row - 1; r <= row + 1; ++r)
      for (auto c = column - 1; c <= column + 1; ++c) {
        const uint32_t id = ids[view][static_cast<size_t>(r * stride + c)];
        // A moving object's triangle stands for an outline here.
        candidates.add(id <= scene->triangles.size() ? id : 0);
      }
  }
  return candidates;
}

void RasterRenderer::State::findTruth(int tile, const CameraFrame& frame) {
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  for (int p = 0; p < kPacketsPerTile; ++p) {
    const PacketRays& packet = table.packet(tile, p);
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    MovingObjects::Centers centers{splat(kInfinity), splat(0.f), splat(0), splat(0)};
    if (packet.valid) {
      const Int8 taken = takeCandidates(packet, x, y, T_camera_world, centers);
      traceMissed(tile, packet, y, frame, simd::maskOfBits(packet.valid) & ~taken, centers);
    }
    truth.put(x, y, centers.depth_m, centers.id, splat(TruthBuffer::kUnknown));
  }
}

// Whether something too narrow to be seen in the view may stand before what it shows here.
bool RasterRenderer::State::mayHideNarrow(int x, int y) const {
  const PlacedPixel& pixel = wide.placed(x, y);
  if (pixel.view < 0) return false;
  const auto view = static_cast<size_t>(pixel.view);
  return narrow[view][static_cast<size_t>(std::lround(pixel.y) * wide.views()[view].pinhole.width +
                                          std::lround(pixel.x))] != 0;
}

// Inside a surface that rests; the lanes where it is met.
Int8 RasterRenderer::State::takeCandidates(const PacketRays& packet, int x, int y,
                                           const SE3& T_camera_world,
                                           MovingObjects::Centers& centers) const {
  Int8 taken = splat(0);
  const CandidateTriangles candidates = candidatesAround(x, y, packet.valid);
  if (!candidates.formOneSurface(*scene)) return taken;
  NearestTriangles nearest;
  std::copy_n(packet.x, 8, nearest.x.begin());
  std::copy_n(packet.y, 8, nearest.y.begin());
  for (const uint32_t candidate : candidates)
    CameraTriangle(*scene, T_camera_world, candidate).meet(nearest);
  for (int lane = 0; lane < 8; ++lane) {
    const auto i = static_cast<size_t>(lane);
    if (nearest.triangle[i] < 0 || mayHideNarrow(x + laneX(lane), y + laneY(lane))) continue;
    taken[lane] = -1;
    centers.depth_m[lane] = static_cast<float>(nearest.depth[i]);
    centers.id[lane] = scene->triangles[static_cast<size_t>(nearest.triangle[i])].instance;
  }
  return taken;
}

// At outlines, on moving objects, where something may be too narrow to be seen, and where no
// candidate stops a ray.
void RasterRenderer::State::traceMissed(int tile, const PacketRays& packet, int y,
                                        const CameraFrame& frame, Int8 missed,
                                        MovingObjects::Centers& centers) const {
  if (!simd::bits(missed)) return;
  const RayPacket rays = frame.rays(simd::load(packet.x), simd::load(packet.y));
  const PacketHits hits = scene->bvh->closest(rays, missed, splat(0.f), true);
  const Float8 depth = PlaneDepth(*scene)(frame, frame, packet, hits);
  centers.depth_m = simd::select(hits.mask, depth, centers.depth_m);
  for (int lane = 0; lane < 8; ++lane) {
    if (!hits.mask[lane]) continue;
    centers.id[lane] = scene->triangles[static_cast<size_t>(hits.triangle[lane])].instance;
  }
  if (!moving || !moving->inTile(tile)) return;
  // Lanes that candidates have stopped are none of the moving objects'.
  centers.t = simd::select(missed, simd::select(hits.mask, hits.t, splat(kInfinity)), splat(0.f));
  moving->traceCenters(tile, packet, y, centers, nullptr);
}

// By the longest way in the image during the exposure.
int RasterRenderer::State::subframeCount(const ExposureMotion& motion) const {
  if (motion.exposure_s == 0 || effort.most_subframes == 1) return 1;
  double longest = 0;
  for (int tile = 0; tile < table.tileCount(); ++tile) {
    longest = std::max(longest, motionInTile(tile, motion, camera.height(), table, truth).way);
    if (moving) longest = std::max(longest, moving->motionInTile(tile));
  }
  const double steps = std::ceil(longest / effort.step_px);
  return static_cast<int>(std::clamp(steps, 1.0, static_cast<double>(effort.most_subframes)));
}

void RasterRenderer::State::addColors(const Subframe& subframe, float brightest) {
  ViewPainter painter{layers, {moving ? moving->lightAround() : scene->lightView()}, brightest};
  for (size_t k = 1; k < layers.size(); ++k) painter.lights.push_back(moving->lightOf(k - 1));
  for (size_t v = 0; v < colors.size(); ++v)
    pool.run(wide.views()[v].pinhole.height / kPacketHeight, [&](int row) {
      painter.addRows(wide.views()[v], row * kPacketHeight, subframe, ids[v], colors[v]);
    });
}

}  // namespace diorama
