#include "sim/triangle_tiles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

constexpr int kBlocks = 8;  // of 4 x 4 pixels, along each side of a tile
static_assert(kBlocks * kPacketWidth == kTileSize && kBlocks == kPacketsPerRow);
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr uint32_t kPartTriangles = 1024;
constexpr double kNear_m = 1e-4;    // what is nearer counts as behind the camera
constexpr float kRounding = 2e-6f;  // of single precision in tests of boxes; some 1/1000 px

struct Interval {
  float low = kInfinity, high = -kInfinity;
  void add(float v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void add(const Interval& o) {
    low = std::min(low, o.low);
    high = std::max(high, o.high);
  }
  bool touches(const Interval& o) const { return low <= o.high && high >= o.low; }
};

// In the plane of the ray directions.
struct Box {
  Interval x, y;
  void add(float px, float py) {
    x.add(px);
    y.add(py);
  }
  void add(const Box& o) {
    x.add(o.x);
    y.add(o.y);
  }
  bool touches(const Box& o) const { return x.touches(o.x) && y.touches(o.y); }
};

// A corner, and where its ray goes.
struct Corner {
  Vector3d p;  // camera frame
  float x = 0, y = 0;
  bool behind = false;

  explicit Corner(const Vector3d& position) : p(position), behind(p.z() < kNear_m) {
    const double inverse = 1 / p.z();
    x = static_cast<float>(p.x() * inverse);
    y = static_cast<float>(p.y() * inverse);
  }
};

// Everywhere when some are behind the camera, nowhere when all are.
template <class Corners>
Box boxAround(const Corners& corners) {
  Box box;
  size_t behind = 0;
  for (const Corner& c : corners) {
    behind += c.behind;
    box.add(c.x, c.y);
  }
  if (behind == corners.size()) return {};
  if (behind > 0) return {{-kInfinity, kInfinity}, {-kInfinity, kInfinity}};
  return {{box.x.low - kRounding, box.x.high + kRounding},
          {box.y.low - kRounding, box.y.high + kRounding}};
}

// a x + b y + c
struct Linear {
  float a, b, c;
  Linear() = default;
  explicit Linear(const Vector3d& v)
      : a(static_cast<float>(v.x())), b(static_cast<float>(v.y())), c(static_cast<float>(v.z())) {}
  Float8 operator()(Float8 x, Float8 y) const { return a * x + (b * y + c); }
  Float8 most(Float8 x, Float8 y, Float8 half_x, Float8 half_y) const {
    return (*this)(x, y) + (std::abs(a) * half_x + std::abs(b) * half_y);
  }
  float most(const Box& box) const {
    return std::max(a * box.x.low, a * box.x.high) + std::max(b * box.y.low, b * box.y.high) + c;
  }
};

// A triangle as the rays (x, y, 1) of the camera see it: a ray meets it where none of the weights,
// which are proportional to those of the corners, is negative. At a common edge the weights of two
// triangles differ in their sign only, to the last bit, so that no ray slips through.
struct Placed {
  Linear weight0, weight1, weight2, inverse_depth;
  Box box;
  uint32_t triangle;

  bool mayTouch(const Box& o) const {
    return weight0.most(o) >= 0 && weight1.most(o) >= 0 && weight2.most(o) >= 0;
  }
};

// Triangles that follow one another: what is known of them, and where the camera sees them.
struct Part {
  uint32_t first_triangle = 0, triangle_count = 0;
  uint32_t first_corner = 0, corner_count = 0;
  Eigen::AlignedBox3d box;  // world

  struct Entry {
    uint32_t tile, placed;
  };
  std::vector<Corner> corners;
  std::vector<Placed> placed;
  std::vector<Entry> found;
  std::vector<uint32_t> begin;    // of each tile in `entries`
  std::vector<uint32_t> entries;  // places in `placed`

  void sortEntries(size_t tiles) {
    begin.assign(tiles + 1, 0);
    for (const Entry& e : found) ++begin[e.tile + 1];
    for (size_t k = 0; k < tiles; ++k) begin[k + 1] += begin[k];
    entries.resize(found.size());
    std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
    for (const Entry& e : found) entries[next[e.tile]++] = e.placed;
  }
};

std::vector<Part> partsOf(const RenderScene& scene) {
  std::vector<Part> parts;
  const auto count = static_cast<uint32_t>(scene.triangles.size());
  for (uint32_t end = 0; end < count;) {
    Part& part = parts.emplace_back();
    part.first_triangle = end;
    const int instance = scene.triangles[end].instance;
    uint32_t low = UINT32_MAX, high = 0;
    for (; end < count && end < part.first_triangle + kPartTriangles &&
           scene.triangles[end].instance == instance;
         ++end)
      for (uint32_t k = 3 * end; k < 3 * end + 3; ++k) {
        low = std::min(low, scene.indices[k]);
        high = std::max(high, scene.indices[k]);
        part.box.extend(scene.corners[scene.indices[k]].cast<double>());
      }
    part.triangle_count = end - part.first_triangle;
    part.first_corner = low;
    part.corner_count = high - low + 1;
  }
  return parts;
}

// Where the rays of a tile go.
struct Tile {
  struct Row {  // boxes around the rays of eight blocks
    Float8 x, y, half_x, half_y;
  };
  Box box;
  std::array<Row, kBlocks> rows;
  Float8 column_low, column_high, row_low, row_high;

  Tile(const RayTable& table, int tile) {
    std::array<Interval, kBlocks> columns, lines;
    for (int r = 0; r < kBlocks; ++r)
      for (int c = 0; c < kBlocks; ++c) {
        Box block;
        for (int p : packetsOf(r, c)) {
          const PacketRays& packet = table.packet(tile, p);
          for (int lane = 0; lane < 8; ++lane)
            if (packet.valid >> lane & 1) block.add(packet.x[lane], packet.y[lane]);
        }
        setBlock(rows[static_cast<size_t>(r)], c, block);
        columns[static_cast<size_t>(c)].add(block.x);
        lines[static_cast<size_t>(r)].add(block.y);
        box.add(block);
      }
    for (size_t k = 0; k < kBlocks; ++k) {
      column_low[k] = columns[k].low;
      column_high[k] = columns[k].high;
      row_low[k] = lines[k].low;
      row_high[k] = lines[k].high;
    }
  }

  static std::array<int, 2> packetsOf(int row, int column) {
    const int upper = 2 * row * kPacketsPerRow + column;
    return {upper, upper + kPacketsPerRow};
  }

 private:
  static void setBlock(Row& row, int c, const Box& block) {
    const bool empty = block.x.low > block.x.high;
    row.x[c] = empty ? 0 : (block.x.low + block.x.high) / 2;
    row.y[c] = empty ? 0 : (block.y.low + block.y.high) / 2;
    row.half_x[c] = empty ? 0 : (block.x.high - block.x.low) / 2 + kRounding;
    row.half_y[c] = empty ? 0 : (block.y.high - block.y.low) / 2 + kRounding;
  }
};

// What the rays of a packet have met so far.
struct Nearest {
  Float8 inverse_depth = splat(0.f);
  Int8 place = splat(-1);  // in a list of triangles
};

void meetPacket(const Placed& t, int place, const PacketRays& packet, Nearest& nearest) {
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  const Float8 least = simd::min(simd::min(t.weight0(x, y), t.weight1(x, y)), t.weight2(x, y));
  const Float8 inverse_depth = t.inverse_depth(x, y);
  const Int8 nearer = (least >= 0.f) & (inverse_depth > nearest.inverse_depth);
  nearest.inverse_depth = simd::select(nearer, inverse_depth, nearest.inverse_depth);
  nearest.place = simd::select(nearer, splat(place), nearest.place);
}

Vector3f normalOf(const RenderScene& scene, uint32_t triangle) {
  const Vector3f p0 = scene.corner(triangle, 0);
  return (scene.corner(triangle, 1) - p0).cross(scene.corner(triangle, 2) - p0);
}

PacketHits hitsOf(const RenderScene& scene, const std::vector<const Placed*>& list,
                  const PacketRays& packet, const Nearest& nearest) {
  PacketHits hits;
  hits.mask = simd::maskOfBits(packet.valid) & (nearest.place >= splat(0));
  hits.t = splat(1.f) / nearest.inverse_depth;
  hits.u = hits.v = splat(0.f);
  hits.normal = simd::splat3(0, 0, 1);
  hits.triangle = splat(0);
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  for (auto pending = static_cast<unsigned>(simd::bits(hits.mask)); pending != 0;) {
    const int place = nearest.place[__builtin_ctz(pending)];
    const Placed& t = *list[static_cast<size_t>(place)];
    const Int8 lanes = nearest.place == splat(place);
    const Float8 w1 = t.weight1(x, y), w2 = t.weight2(x, y), sum = t.weight0(x, y) + w1 + w2;
    hits.u = simd::select(lanes, w1 / sum, hits.u);
    hits.v = simd::select(lanes, w2 / sum, hits.v);
    hits.triangle = simd::select(lanes, splat(static_cast<int>(t.triangle)), hits.triangle);
    hits.normal = simd::select(lanes, simd::splat3(normalOf(scene, t.triangle)), hits.normal);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
  return hits;
}

// The triangles of a tile one after the other.
class TileMeeting {
 public:
  TileMeeting(const RenderScene& scene, const RayTable& table, int tile, const Tile& rays)
      : scene_(scene), table_(table), tile_(tile), rays_(rays) {
    farthest_.fill(splat(0.f));
  }

  void meet(const Placed& t) {
    const int place = static_cast<int>(list_.size());
    list_.push_back(&t);
    const Int8 columns = (rays_.column_low <= t.box.x.high) & (rays_.column_high >= t.box.x.low);
    auto rows = static_cast<unsigned>(
        simd::bits((rays_.row_low <= t.box.y.high) & (rays_.row_high >= t.box.y.low)));
    for (; rows != 0; rows &= rows - 1) {
      const int row = __builtin_ctz(rows);
      for (auto rest = static_cast<unsigned>(simd::bits(columns & blocksOf(t, row))); rest != 0;
           rest &= rest - 1)
        meetBlock(t, place, row, __builtin_ctz(rest));
    }
  }

  PacketHits hits(int p) const {
    return hitsOf(scene_, list_, table_.packet(tile_, p), nearest_[static_cast<size_t>(p)]);
  }

 private:
  // Those of a row that the triangle may touch before what they show.
  Int8 blocksOf(const Placed& t, int row) const {
    const Tile::Row& r = rays_.rows[static_cast<size_t>(row)];
    const auto most = [&](const Linear& f) { return f.most(r.x, r.y, r.half_x, r.half_y); };
    const Float8 inside = simd::min(simd::min(most(t.weight0), most(t.weight1)), most(t.weight2));
    return (inside >= 0.f) & (most(t.inverse_depth) >= farthest_[static_cast<size_t>(row)]);
  }

  void meetBlock(const Placed& t, int place, int row, int column) {
    Float8 least = splat(kInfinity);
    for (int p : Tile::packetsOf(row, column)) {
      Nearest& nearest = nearest_[static_cast<size_t>(p)];
      meetPacket(t, place, table_.packet(tile_, p), nearest);
      least = simd::min(least, nearest.inverse_depth);
    }
    farthest_[static_cast<size_t>(row)][column] = simd::least(least);
  }

  const RenderScene& scene_;
  const RayTable& table_;
  int tile_;
  const Tile& rays_;
  std::vector<const Placed*> list_;
  std::array<Nearest, kPacketsPerTile> nearest_;
  std::array<Float8, kBlocks> farthest_;  // least inverse depth of each block
};

// Which of some intervals, one behind the other, an interval may touch.
class Ranks {
 public:
  explicit Ranks(const std::vector<Interval>& intervals) {
    for (const Interval& i : intervals) all_.add(i);
    for (size_t slot = 0; slot < kSlots; ++slot) {
      const Interval part{edge(slot) - kRounding, edge(slot + 1) + kRounding};
      while (first_[slot] < intervals.size() && intervals[first_[slot]].high < part.low)
        ++first_[slot];
      end_[slot] = static_cast<uint32_t>(intervals.size());
      while (end_[slot] > 0 && intervals[end_[slot] - 1].low > part.high) --end_[slot];
    }
  }
  // The first and one past the last.
  std::pair<uint32_t, uint32_t> touched(const Interval& i) const {
    return {first_[slot(i.low)], end_[slot(i.high)]};
  }

 private:
  static constexpr size_t kSlots = 256;
  float edge(size_t slot) const {
    return all_.low + (all_.high - all_.low) * static_cast<float>(slot) / kSlots;
  }
  size_t slot(float v) const {
    const float place = (v - all_.low) * (kSlots / (all_.high - all_.low));
    return static_cast<size_t>(std::clamp(place, 0.f, kSlots - 1.f));
  }

  Interval all_;
  std::array<uint32_t, kSlots> first_{}, end_{};
};

std::vector<Tile> tilesOf(const RayTable& table) {
  std::vector<Tile> tiles;
  for (int k = 0; k < table.tileCount(); ++k) tiles.emplace_back(table, k);
  return tiles;
}

// Of the columns of tiles, or of their rows: `rank` tells which one a tile belongs to.
template <class Rank>
Ranks ranksOf(const std::vector<Tile>& tiles, int count, Interval Box::*side, const Rank& rank) {
  std::vector<Interval> intervals(static_cast<size_t>(count));
  for (size_t k = 0; k < tiles.size(); ++k) intervals[rank(k)].add(tiles[k].box.*side);
  return Ranks(intervals);
}

}  // namespace

struct TriangleTiles::State {
  State(const RenderScene& s, const RayTable& t)
      : scene(s),
        table(t),
        parts(partsOf(s)),
        tiles(tilesOf(t)),
        tiles_x(static_cast<size_t>(t.tilesX())),
        columns(ranksOf(tiles, t.tilesX(), &Box::x, [this](size_t k) { return k % tiles_x; })),
        rows(ranksOf(tiles, t.tileCount() / t.tilesX(), &Box::y,
                     [this](size_t k) { return k / tiles_x; })) {
    for (const Tile& tile : tiles) image.add(tile.box);
  }

  void place(Part& part, const Matrix3d& R, const Vector3d& t) const;
  void addToTiles(Part& part, const Placed& placed) const;

  const RenderScene& scene;
  const RayTable& table;
  std::vector<Part> parts;
  std::vector<Tile> tiles;
  size_t tiles_x;
  Ranks columns, rows;  // of tiles
  Box image;
  std::vector<uint32_t> order;  // of the parts that are seen
};

TriangleTiles::TriangleTiles(const RenderScene& scene, const RayTable& table)
    : state_(std::make_unique<State>(scene, table)) {}
TriangleTiles::~TriangleTiles() = default;

void TriangleTiles::sort(const CameraFrame& camera, WorkerPool& pool) {
  const Matrix3d R = camera.R.transpose();
  const Vector3d t = -R * camera.origin;
  std::vector<Part>& parts = state_->parts;
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

void TriangleTiles::State::place(Part& part, const Matrix3d& R, const Vector3d& t) const {
  part.corners.clear();
  part.placed.clear();
  part.found.clear();
  part.entries.clear();
  std::vector<Corner> around;
  for (int k = 0; k < 8; ++k)
    around.emplace_back(R * part.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) + t);
  if (!boxAround(around).touches(image)) return;

  for (uint32_t k = 0; k < part.corner_count; ++k)
    part.corners.emplace_back(R * scene.corners[part.first_corner + k].cast<double>() + t);
  for (uint32_t k = 0; k < part.triangle_count; ++k) {
    const uint32_t triangle = part.first_triangle + k;
    const auto corner = [&](uint32_t i) -> const Corner& {
      return part.corners[scene.indices[3 * triangle + i] - part.first_corner];
    };
    const Corner &c0 = corner(0), &c1 = corner(1), &c2 = corner(2);
    Placed placed;
    placed.box = boxAround(std::array<std::reference_wrapper<const Corner>, 3>{c0, c1, c2});
    if (!placed.box.touches(image)) continue;
    const Vector3d normal = (c1.p - c0.p).cross(c2.p - c0.p);
    const double volume = normal.dot(c0.p);
    if (volume == 0) continue;  // edge-on
    const double side = volume > 0 ? 1 : -1;
    placed.weight0 = Linear(side * c1.p.cross(c2.p));
    placed.weight1 = Linear(side * c2.p.cross(c0.p));
    placed.weight2 = Linear(side * c0.p.cross(c1.p));
    placed.inverse_depth = Linear(normal / volume);
    placed.triangle = triangle;
    addToTiles(part, placed);
  }
  part.sortEntries(tiles.size());
}

void TriangleTiles::State::addToTiles(Part& part, const Placed& placed) const {
  const auto [first_column, end_column] = columns.touched(placed.box.x);
  const auto [first_row, end_row] = rows.touched(placed.box.y);
  const auto add = [&](size_t tile) {
    part.found.push_back({static_cast<uint32_t>(tile), static_cast<uint32_t>(part.placed.size())});
  };
  for (size_t row = first_row; row < end_row; ++row)
    for (size_t column = first_column; column < end_column; ++column) {
      const size_t tile = row * tiles_x + column;
      const Box& box = tiles[tile].box;
      if (placed.box.touches(box) && placed.mayTouch(box)) add(tile);
    }
  part.placed.push_back(placed);
}

void TriangleTiles::meet(int tile, TileHits& hits) const {
  const auto at = static_cast<size_t>(tile);
  TileMeeting meeting(state_->scene, state_->table, tile, state_->tiles[at]);
  for (const uint32_t k : state_->order) {
    const Part& part = state_->parts[k];
    for (uint32_t e = part.begin[at]; e < part.begin[at + 1]; ++e)
      meeting.meet(part.placed[part.entries[e]]);
  }
  for (int p = 0; p < kPacketsPerTile; ++p) hits[static_cast<size_t>(p)] = meeting.hits(p);
}

}  // namespace diorama
