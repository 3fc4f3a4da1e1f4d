#include "sim/triangle_tiles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "sim/prefetch.h"
#include "sim/tile_rays.h"
#include "sim/triangle_part.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

struct ListedTriangle {
  const PlacedTriangle* placed;
  const CameraPlane* plane;
};

// What the rays of a packet have met so far.
struct Nearest {
  Float8 inverse_depth = splat(0.f);
  Int8 place = splat(-1);  // in a list of triangles
};

void meetPacket(const PlacedTriangle& t, int place, const PacketRays& packet, Nearest& nearest) {
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  const Float8 least = simd::min(simd::min(t.weight0(x, y), t.weight1(x, y)), t.weight2(x, y));
  const Float8 inverse_depth = t.inverse_depth(x, y);
  const Int8 nearer = (least >= 0.f) & (inverse_depth > nearest.inverse_depth);
  nearest.inverse_depth = simd::select(nearer, inverse_depth, nearest.inverse_depth);
  nearest.place = simd::select(nearer, splat(place), nearest.place);
}

PacketHits hitsOf(const RenderScene& scene, const std::vector<ListedTriangle>& list,
                  const PacketRays& packet, const Nearest& nearest) {
  PacketHits hits;
  hits.mask = simd::maskOfBits(packet.valid) & (nearest.place >= splat(0));
  const Float8 t_roughly = splat(1.f) / nearest.inverse_depth;
  hits.t = t_roughly;
  hits.u = hits.v = splat(0.f);
  hits.normal = simd::splat3(0, 0, 1);
  hits.triangle = splat(0);
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  for (auto pending = static_cast<unsigned>(simd::bits(hits.mask)); pending != 0;) {
    const int place = nearest.place[__builtin_ctz(pending)];
    const auto& [placed, plane] = list[static_cast<size_t>(place)];
    const PlacedTriangle& t = *placed;
    const Int8 lanes = nearest.place == splat(place);
    const Float8 w1 = t.weight1(x, y), w2 = t.weight2(x, y), sum = t.weight0(x, y) + w1 + w2;
    prefetchTriangle(scene, t.triangle);
    hits.t = simd::select(lanes, plane->depth(packet), hits.t);
    hits.u = simd::select(lanes, w1 / sum, hits.u);
    hits.v = simd::select(lanes, w2 / sum, hits.v);
    hits.triangle = simd::select(lanes, splat(static_cast<int>(t.triangle)), hits.triangle);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
  hits.t = CameraPlane::chosen(hits.t, t_roughly);
  return hits;
}

// The triangles of a tile one after the other.
class TileMeeting {
 public:
  TileMeeting(const RayTable& table, int tile, const TileRays& rays)
      : table_(table), tile_(tile), rays_(rays) {
    farthest_.fill(splat(0.f));
  }

  void meet(const PlacedTriangle& t, const CameraPlane& plane) {
    const int place = static_cast<int>(list_.size());
    list_.push_back({&t, &plane});
    const Int8 columns = (rays_.column_low <= t.box.x1) & (rays_.column_high >= t.box.x0);
    auto rows = static_cast<unsigned>(
        simd::bits((rays_.row_low <= t.box.y1) & (rays_.row_high >= t.box.y0)));
    for (; rows != 0; rows &= rows - 1) {
      const int row = __builtin_ctz(rows);
      for (auto rest = static_cast<unsigned>(simd::bits(columns & blocksOf(t, row))); rest != 0;
           rest &= rest - 1)
        meetBlock(t, place, row, __builtin_ctz(rest));
    }
  }

  PacketHits hits(int p, const RenderScene& scene) const {
    return hitsOf(scene, list_, table_.packet(tile_, p), nearest_[static_cast<size_t>(p)]);
  }

 private:
  // Those of a row that the triangle may touch before what they show.
  Int8 blocksOf(const PlacedTriangle& t, int row) const {
    const TileRays::Row& r = rays_.rows[static_cast<size_t>(row)];
    const auto most = [&](const LinearForm& f) { return f.most(r.x, r.y, r.half_x, r.half_y); };
    const Float8 inside = simd::min(simd::min(most(t.weight0), most(t.weight1)), most(t.weight2));
    return (inside >= 0.f) & (most(t.inverse_depth) >= farthest_[static_cast<size_t>(row)]);
  }

  void meetBlock(const PlacedTriangle& t, int place, int row, int column) {
    Float8 least = splat(std::numeric_limits<float>::infinity());
    for (int p : TileRays::packetsOf(row, column)) {
      Nearest& nearest = nearest_[static_cast<size_t>(p)];
      meetPacket(t, place, table_.packet(tile_, p), nearest);
      least = simd::min(least, nearest.inverse_depth);
    }
    farthest_[static_cast<size_t>(row)][column] = simd::least(least);
  }

  const RayTable& table_;
  int tile_;
  const TileRays& rays_;
  std::vector<ListedTriangle> list_;
  std::array<Nearest, kPacketsPerTile> nearest_;
  std::array<Float8, kTileBlocks> farthest_;  // least inverse depth of each block
};

std::vector<TileRays> tilesOf(const RayTable& table, float margin_px) {
  std::vector<TileRays> tiles;
  for (int k = 0; k < table.tileCount(); ++k) tiles.emplace_back(table, k, margin_px);
  return tiles;
}

// Of the columns of tiles and of their rows.
std::pair<TileRanks, TileRanks> ranksOf(const std::vector<TileRays>& tiles, size_t tiles_x) {
  std::vector<DirectionBox> columns(tiles_x), rows(tiles.size() / tiles_x);
  for (size_t k = 0; k < tiles.size(); ++k) {
    columns[k % tiles_x].extend(tiles[k].box);
    rows[k / tiles_x].extend(tiles[k].box);
  }
  std::vector<TileRanks::Interval> x, y;
  for (const DirectionBox& box : columns) x.push_back({box.x0, box.x1});
  for (const DirectionBox& box : rows) y.push_back({box.y0, box.y1});
  return {TileRanks(x), TileRanks(y)};
}

}  // namespace

struct TriangleTiles::State {
  State(const RenderScene& s, const RayTable& t, float margin)
      : scene(s),
        table(t),
        parts(TrianglePart::of(s)),
        margin_px(margin),
        tiles(tilesOf(t, margin)),
        tiles_x(static_cast<size_t>(t.tilesX())),
        ranks(ranksOf(tiles, tiles_x)) {
    for (const TileRays& tile : tiles) image.extend(tile.box);
  }

  void setCamera(const CameraFrame& c, double r_m);
  bool hidesItself(uint32_t triangle, const Vector3d& normal, double volume) const;
  void place(TrianglePart& part, const Matrix3d& R, const Vector3d& t) const;
  void addToTiles(TrianglePart& part, const PlacedTriangle& placed) const;

  const RenderScene& scene;
  const RayTable& table;
  std::vector<TrianglePart> parts;
  float margin_px;
  std::vector<TileRays> tiles;
  size_t tiles_x;
  std::pair<TileRanks, TileRanks> ranks;  // of columns and rows of tiles
  DirectionBox image;
  CameraFrame camera{SE3()};
  double reach_m = 0;
  std::vector<uint8_t> outside;  // of closed surfaces: no ray starts in their boxes
  std::vector<uint32_t> order;   // of the parts that are seen

  template <class Visit>
  void visit(int tile, const Visit& visit) const {
    const auto at = static_cast<size_t>(tile);
    for (const uint32_t k : order) {
      const TrianglePart& part = parts[k];
      for (uint32_t e = part.begin[at]; e < part.begin[at + 1]; ++e)
        visit(part.placed[part.entries[e]], part.planes[part.entries[e]]);
    }
  }
};

TriangleTiles::TriangleTiles(const RenderScene& scene, const RayTable& table, float margin_px)
    : state_(std::make_unique<State>(scene, table, margin_px)) {}
TriangleTiles::~TriangleTiles() = default;

void TriangleTiles::sort(const CameraFrame& camera, WorkerPool& pool, double reach_m) {
  state_->setCamera(camera, reach_m);
  const Matrix3d R = camera.R.transpose();
  const Vector3d t = -R * camera.origin;
  std::vector<TrianglePart>& parts = state_->parts;
  pool.run(static_cast<int>(parts.size()),
           [&](int k) { state_->place(parts[static_cast<size_t>(k)], R, t); });
  // What is near first: it hides the rest.
  std::vector<std::pair<double, uint32_t>> distances;
  for (uint32_t k = 0; k < parts.size(); ++k)
    if (!parts[k].placed.empty())
      distances.emplace_back(parts[k].box.squaredExteriorDistance(camera.origin), k);
  std::sort(distances.begin(), distances.end());
  state_->order.clear();
  for (const auto& [distance, k] : distances) state_->order.push_back(k);
}

void TriangleTiles::State::setCamera(const CameraFrame& c, double r_m) {
  camera = c;
  reach_m = r_m;
  outside.clear();
  const Vector3f origin = c.origin.cast<float>();
  const auto around = static_cast<float>(r_m + 2 * ImagedCorner::kNear_m);
  for (const Eigen::AlignedBox3f& box : scene.closed.boxes)
    outside.push_back(box.squaredExteriorDistance(origin) > around * around);
}

// Whether rays that start within reach meet the triangle from behind, and so its surface before.
// `normal` is in the camera's frame, `volume` its product with a corner.
bool TriangleTiles::State::hidesItself(uint32_t triangle, const Vector3d& normal,
                                       double volume) const {
  const int surface = scene.closed.of_triangle[triangle];
  return volume > 0 && surface != ClosedSurfaces::kOpen && outside[static_cast<size_t>(surface)] &&
         volume * volume > reach_m * reach_m * normal.squaredNorm();
}

void TriangleTiles::State::place(TrianglePart& part, const Matrix3d& R, const Vector3d& t) const {
  part.clear();
  std::vector<ImagedCorner> around;
  for (int k = 0; k < 8; ++k)
    around.emplace_back(R * part.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) + t);
  if (!boxAround(around).meets(image)) return;

  for (uint32_t k = 0; k < part.corner_count; ++k)
    part.corners.emplace_back(R * scene.corners[part.first_corner + k].cast<double>() + t);
  const Vector3f from = camera.origin.cast<float>();
  const bool outside_all = std::all_of(part.closed.begin(), part.closed.end(), [&](int surface) {
    return outside[static_cast<size_t>(surface)] != 0;
  });
  unsigned hidden = 0;
  for (uint32_t k = 0; k < part.triangle_count; ++k) {
    if (k % 8 == 0 && outside_all) hidden = part.turnedAway(k, from, static_cast<float>(reach_m));
    if (hidden >> k % 8 & 1) continue;
    const uint32_t triangle = part.first_triangle + k;
    const auto corner = [&](uint32_t i) -> const ImagedCorner& {
      return part.corners[scene.indices[3 * triangle + i] - part.first_corner];
    };
    const ImagedCorner &c0 = corner(0), &c1 = corner(1), &c2 = corner(2);
    PlacedTriangle placed;
    placed.box = boxAround(std::array<std::reference_wrapper<const ImagedCorner>, 3>{c0, c1, c2});
    if (!placed.box.meets(image)) continue;
    const Vector3d normal = (c1.p - c0.p).cross(c2.p - c0.p);
    const double volume = normal.dot(c0.p);
    if (volume == 0) continue;  // edge-on
    if (hidesItself(triangle, normal, volume)) continue;
    const double side = volume > 0 ? 1 : -1;
    placed.weight0 = LinearForm(side * c1.p.cross(c2.p));
    placed.weight1 = LinearForm(side * c2.p.cross(c0.p));
    placed.weight2 = LinearForm(side * c0.p.cross(c1.p));
    placed.inverse_depth = LinearForm(normal / volume);
    placed.triangle = triangle;
    placed.side = static_cast<float>(side);
    addToTiles(part, placed);
    part.planes.push_back({normal, volume});
  }
  part.sortEntries(tiles.size());
}

void TriangleTiles::State::addToTiles(TrianglePart& part, const PlacedTriangle& placed) const {
  const auto [first_column, end_column] = ranks.first.touched(placed.box.x0, placed.box.x1);
  const auto [first_row, end_row] = ranks.second.touched(placed.box.y0, placed.box.y1);
  const auto add = [&](size_t tile) {
    part.found.push_back({static_cast<uint32_t>(tile), static_cast<uint32_t>(part.placed.size())});
  };
  for (size_t row = first_row; row < end_row; ++row)
    for (size_t column = first_column; column < end_column; ++column) {
      const size_t tile = row * tiles_x + column;
      const DirectionBox& box = tiles[tile].box;
      if (placed.box.meets(box) && placed.mayTouch(box)) add(tile);
    }
  part.placed.push_back(placed);
}

void TriangleTiles::meet(int tile, TileHits& hits) const {
  TileMeeting meeting(state_->table, tile, rays(tile));
  state_->visit(tile,
                [&](const PlacedTriangle& t, const CameraPlane& plane) { meeting.meet(t, plane); });
  for (int p = 0; p < kPacketsPerTile; ++p)
    hits[static_cast<size_t>(p)] = meeting.hits(p, state_->scene);
}

const CameraFrame& TriangleTiles::camera() const { return state_->camera; }
float TriangleTiles::margin_px() const { return state_->margin_px; }
const TileRays& TriangleTiles::rays(int tile) const {
  return state_->tiles[static_cast<size_t>(tile)];
}

void TriangleTiles::list(int tile, std::vector<const PlacedTriangle*>& triangles) const {
  triangles.clear();
  state_->visit(tile,
                [&](const PlacedTriangle& t, const CameraPlane&) { triangles.push_back(&t); });
}

}  // namespace diorama
