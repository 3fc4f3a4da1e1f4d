#include "sim/silhouettes.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

int count(int bits) { return __builtin_popcount(static_cast<unsigned>(bits)); }

}  // namespace

SilhouetteTracer::SilhouetteTracer(const RenderScene& scene, const Camera& camera,
                                   const RayTable& table)
    : scene_(scene), camera_(camera), table_(table), tile_boxes_(tileBoxes(table)) {}

SilhouetteTracer::~SilhouetteTracer() = default;

namespace {

DirectionBox boxOf(const SceneInstance& instance, const CameraFrame& camera) {
  return DirectionBox::of(instance.min_corner, instance.max_corner,
                          camera.T_world_camera.inverse() * instance.T_world_object);
}

// The box as seen by the first `rows` rows from y on, by the next ones, ...
std::vector<DirectionBox> boxesOf(const SceneInstance& instance, const RowCameras& cameras, int y,
                                  int rows, int count) {
  if (!cameras.rolling())
    return std::vector<DirectionBox>(static_cast<size_t>(count), boxOf(instance, cameras[0]));
  std::vector<DirectionBox> boxes(static_cast<size_t>(count));
  for (DirectionBox& all : boxes)
    for (int k = 0; k < rows; ++k, ++y) all.extend(boxOf(instance, cameras[y]));
  return boxes;
}

}  // namespace

std::vector<Silhouette> SilhouetteTracer::trace(const RowCameras& cameras,
                                                std::span<const RowCameras> moving,
                                                const TruthBuffer& truth, WorkerPool& pool) {
  std::vector<Silhouette> result;
  for (size_t id = 0; id < scene_.instances.size(); ++id) {
    const SceneInstance& instance = scene_.instances[id];
    if (!instance.tracked) continue;
    Silhouette silhouette;
    silhouette.mask = Image<uint8_t>(camera_.width(), camera_.height());
    const RowCameras& own =
        instance.moving < 0 ? cameras : moving[static_cast<size_t>(instance.moving)];
    traceInside(static_cast<int>(id), own, truth, pool, silhouette);
    silhouette.px_all = silhouette.px_valid + countOutside(instance, own, pool, silhouette.outside);
    result.push_back(std::move(silhouette));
  }
  return result;
}

void SilhouetteTracer::traceInside(int id, const RowCameras& cameras, const TruthBuffer& truth,
                                   WorkerPool& pool, Silhouette& silhouette) const {
  const SceneInstance& instance = scene_.instances[static_cast<size_t>(id)];
  const Bvh& bvh = *instance.alone;
  const std::vector<DirectionBox> boxes =
      boxesOf(instance, cameras, 0, kTileSize, table_.tileCount() / table_.tilesX());
  struct Counts {
    int valid = 0, visible = 0;
  };
  std::vector<Counts> counts(static_cast<size_t>(table_.tileCount()));
  pool.run(table_.tileCount(), [&](int tile) {
    const DirectionBox& box = boxes[static_cast<size_t>(tile / table_.tilesX())];
    if (!tile_boxes_[static_cast<size_t>(tile)].meets(box)) return;
    Counts& sum = counts[static_cast<size_t>(tile)];
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketRays& packet = table_.packet(tile, p);
      const int x = table_.packetX(tile, p), y = table_.packetY(tile, p);
      int visible = 0;
      for (int lane = 0; lane < 8; ++lane)
        visible |= (truth.instance(x + laneX(lane), y + laneY(lane)) == id) << lane;
      visible &= packet.valid;
      const Float8 dx = simd::load(packet.x), dy = simd::load(packet.y);
      const Int8 near = (dx >= box.x0) & (dx <= box.x1) & (dy >= box.y0) & (dy <= box.y1);
      const int open = simd::bits(near) & packet.valid & ~visible;
      int all = visible;
      if (open)
        all |= simd::bits(bvh.occluded(cameras.rays(packet, y), simd::maskOfBits(open), splat(0.f),
                                       splat(std::numeric_limits<float>::infinity()), true));
      sum.visible += count(visible);
      sum.valid += count(all);
      for (int lane = 0; lane < 8; ++lane)
        if (all >> lane & 1) silhouette.mask(x + laneX(lane), y + laneY(lane)) = 255;
    }
  });
  for (const Counts& c : counts) {
    silhouette.px_valid += c.valid;
    silhouette.px_visible += c.visible;
  }
}

int SilhouetteTracer::countOutside(const SceneInstance& instance, const RowCameras& cameras,
                                   WorkerPool& pool, PixelBox& outside) {
  // An object whose box lies well within the outermost tiles cannot leave the image.
  if (!beyond_) beyond_ = std::make_unique<ExtendedGrid>(camera_);
  const ExtendedGrid& grid = *beyond_;
  constexpr int kCell = ExtendedGrid::kCell;
  const int w = camera_.width(), h = camera_.height();
  const std::vector<DirectionBox> boxes = boxesOf(instance, cameras, -h, kCell, grid.rows());
  std::vector<int> counts(static_cast<size_t>(grid.rows()), 0);
  std::vector<PixelBox> found(counts.size());
  pool.run(grid.rows(), [&](int r) {
    for (int c = 0; c < grid.columns(); ++c) {
      const int x = grid.cellX(c), y = grid.cellY(r);
      if (x >= 0 && y >= 0 && x + kCell <= w && y + kCell <= h) continue;
      DirectionBox cell;
      for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2f& d = grid.corner(c + (k & 1), r + (k >> 1));
        cell.extend(d.x(), d.y());
      }
      if (!cell.meets(boxes[static_cast<size_t>(r)])) continue;
      for (int row = 0; row < kCell; ++row) {
        const auto [dx, dy] = grid.row(c, r, row);
        const Int8 u = Int8{0, 1, 2, 3, 4, 5, 6, 7} + x;
        const Int8 canvas = (u < 2 * w) & splat(y + row < 2 * h ? -1 : 0);
        const Int8 image = (u >= 0) & (u < w) & splat(y + row >= 0 && y + row < h ? -1 : 0);
        const Int8 active = canvas & ~image;
        if (!simd::bits(active)) continue;
        const int hit = simd::bits(
            instance.alone->occluded(cameras[y + row].rays(dx, dy), active, splat(0.f),
                                     splat(std::numeric_limits<float>::infinity()), true));
        if (!hit) continue;
        counts[static_cast<size_t>(r)] += count(hit);
        for (int lane = 0; lane < 8; ++lane)
          if (hit >> lane & 1) found[static_cast<size_t>(r)].add(x + lane, y + row);
      }
    }
  });
  for (const PixelBox& box : found) outside.add(box);
  return std::accumulate(counts.begin(), counts.end(), 0);
}

}  // namespace diorama
