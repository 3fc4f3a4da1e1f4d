#include "sim/sample_candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sim/prefetch.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

constexpr int kPacketsPerBlock = 2;
// Depths change a little while the camera moves: what lies behind by less is looked at.
constexpr float kBehind = 0.9f, kSurelyBehind = 0.95f;  // of inverse depths

size_t blockOf(int p) {
  return static_cast<size_t>(p / kPacketsPerRow / kPacketsPerBlock * kTileBlocks +
                             p % kPacketsPerRow);
}

Vector8 cross(const Vector8& a, const Vector8& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Float8 dot(const Vector3f& a, const Vector8& b) { return a.x() * b.x + a.y() * b.y + a.z() * b.z; }
Float8 dot(const LinearForm& f, const Vector8& v) { return f.a * v.x + (f.b * v.y + f.c * v.z); }

}  // namespace

// The triangles nearest to the camera along some rays.
struct SampleCandidates::Nearest {
  Float8 inverse_depth = splat(0.f);
  Int8 triangle = splat(-1);
  Float8 weight0 = splat(1.f), weight1 = splat(0.f), weight2 = splat(0.f);
};

struct SampleCandidates::Rays {
  Vector8 direction, start;  // in the camera
  Vector8 moment;            // direction x start, world

  Rays(const RayPacket& rays, const CameraFrame& camera) {
    const Eigen::Matrix3f R_camera_world = camera.R.transpose().cast<float>();
    const auto inCamera = [&](const Vector8& v) {
      return Vector8{diorama::dot(R_camera_world.row(0), v), diorama::dot(R_camera_world.row(1), v),
                     diorama::dot(R_camera_world.row(2), v)};
    };
    const Vector8 from_camera = rays.origin - simd::splat3(camera.origin);
    direction = inCamera(rays.direction);
    start = inCamera(from_camera);
    moment = cross(rays.direction, from_camera);
  }
};

[[gnu::always_inline]] inline std::array<Float8, 3> SampleCandidates::Candidate::weights(
    const Rays& rays) const {
  return {dot(placed.weight0, rays.direction) - dot(side0, rays.moment),
          dot(placed.weight1, rays.direction) - dot(side1, rays.moment),
          dot(placed.weight2, rays.direction) - dot(side2, rays.moment)};
}

void SampleCandidates::gather(int tile, const TileMotion& motion, const RoughPixels& rough,
                              const TruthBuffer& truth) {
  // Half the way and half a pixel, and something for ways that are longer between the points at
  // which they are known.
  const double x_px = 0.6 * motion.x + 0.6, y_px = 0.6 * motion.y + 0.6;
  tile_ = tile;
  candidates_.clear();
  for (std::vector<uint32_t>& block : in_block_) block.clear();
  gathered_ = std::max(x_px, y_px) <= static_cast<double>(tiles_.margin_px());
  if (!gathered_) return;
  const TileRays& rays = tiles_.rays(tile);
  margin_x_ = rays.marginX(static_cast<float>(x_px), static_cast<float>(y_px));
  margin_y_ = rays.marginY(static_cast<float>(x_px), static_cast<float>(y_px));
  rows_ = rays.rows;
  for (TileRays::Row& row : rows_) {
    row.half_x += margin_x_;
    row.half_y += margin_y_;
  }
  gatherBlocks(rough, {static_cast<int>(std::ceil(x_px)), static_cast<int>(std::ceil(y_px))},
               truth);
  tiles_.list(tile, listed_);
  for (const PlacedTriangle* triangle : listed_) sortIn(*triangle);
}

void SampleCandidates::gatherBlocks(const RoughPixels& rough, Reach reach,
                                    const TruthBuffer& truth) {
  for (int row = 0; row < kTileBlocks; ++row)
    for (int column = 0; column < kTileBlocks; ++column) {
      const auto [upper, lower] = TileRays::packetsOf(row, column);
      const auto r = static_cast<size_t>(row);
      const bool any = (rough[static_cast<size_t>(upper)] | rough[static_cast<size_t>(lower)]) != 0;
      rough_[r][column] = any ? -1 : 0;
      farthest_[r][column] = any ? truth.leastInverseDepth(table_.packetX(tile_, upper),
                                                           table_.packetY(tile_, upper), reach)
                                 : 0;
    }
}

// Into the blocks that it may touch before what they show.
void SampleCandidates::sortIn(const PlacedTriangle& t) {
  const TileRays& rays = tiles_.rays(tile_);
  const Int8 columns =
      (rays.column_low <= t.box.x1 + margin_x_) & (rays.column_high >= t.box.x0 - margin_x_);
  auto rows = static_cast<unsigned>(
      simd::bits((rays.row_low <= t.box.y1 + margin_y_) & (rays.row_high >= t.box.y0 - margin_y_)));
  const auto place = static_cast<uint32_t>(candidates_.size());
  bool found = false;
  for (; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<size_t>(__builtin_ctz(rows));
    const TileRays::Row& r = rows_[row];
    const auto most = [&](const LinearForm& f) { return f.most(r.x, r.y, r.half_x, r.half_y); };
    const Float8 inside = simd::min(simd::min(most(t.weight0), most(t.weight1)), most(t.weight2));
    const Int8 touched = columns & rough_[row] & (inside >= 0.f) &
                         (most(t.inverse_depth) >= kBehind * farthest_[row]);
    for (auto rest = static_cast<unsigned>(simd::bits(touched)); rest != 0; rest &= rest - 1) {
      in_block_[row * kTileBlocks + static_cast<size_t>(__builtin_ctz(rest))].push_back(place);
      found = true;
    }
  }
  if (found) candidates_.push_back(candidate(t));
}

SampleCandidates::Candidate SampleCandidates::candidate(const PlacedTriangle& t) const {
  const Vector3f p0 = scene_.corner(t.triangle, 0), p1 = scene_.corner(t.triangle, 1),
                 p2 = scene_.corner(t.triangle, 2);
  prefetchTriangle(scene_, t.triangle);
  return {t, t.side * (p2 - p1), t.side * (p0 - p2), t.side * (p1 - p0)};
}

// Neither this nor findTouched() branches on what a candidate touches: such branches are guessed
// wrongly so often that arithmetic which is not needed takes less time.
void SampleCandidates::choose(int p, int lanes) {
  pixel_count_.fill(0);
  if (!gathered_) return;
  const size_t count = findTouched(p, lanes);
  per_pixel_ = count + 1;
  if (in_pixel_.size() < 8 * per_pixel_) in_pixel_.resize(8 * per_pixel_);
  for (auto rest = static_cast<unsigned>(lanes); rest != 0; rest &= rest - 1) {
    const auto lane = static_cast<size_t>(__builtin_ctz(rest));
    uint32_t* list = &in_pixel_[lane * per_pixel_];
    size_t found = 0;
    for (size_t k = 0; k < count; ++k) {
      list[found] = touched_[k].place;
      found += static_cast<size_t>(touched_[k].lanes >> lane & 1);
    }
    pixel_count_[lane] = found;
  }
}

// Candidates that samples of those pixels of a packet may meet: how many there are.
size_t SampleCandidates::findTouched(int p, int lanes) {
  const PacketRays& packet = table_.packet(tile_, p);
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  const Float8 half_x = splat(margin_x_), half_y = splat(margin_y_);
  const size_t block = blockOf(p);
  chosen_farthest_ = farthest_[block / kTileBlocks][static_cast<int>(block % kTileBlocks)];
  if (touched_.size() <= in_block_[block].size()) touched_.resize(in_block_[block].size() + 1);
  size_t count = 0;
  for (const uint32_t place : in_block_[block]) {
    const PlacedTriangle& t = candidates_[place].placed;
    const Int8 in_box = (x <= t.box.x1 + margin_x_) & (x >= t.box.x0 - margin_x_) &
                        (y <= t.box.y1 + margin_y_) & (y >= t.box.y0 - margin_y_);
    const auto most = [&](const LinearForm& f) { return f.most(x, y, half_x, half_y); };
    const Float8 inside = simd::min(simd::min(most(t.weight0), most(t.weight1)), most(t.weight2));
    const Int8 in_sight = most(t.inverse_depth) >= kBehind * chosen_farthest_;
    const int touched = simd::bits(in_box & (inside >= 0.f) & in_sight) & lanes;
    touched_[count] = {place, touched};
    count += touched != 0;
  }
  return count;
}

PacketHits SampleCandidates::closest(size_t lane, const RayPacket& rays) const {
  const auto trace = [&] { return scene_.quick_bvh->closest(rays, splat(-1), splat(0.f), true); };
  if (!gathered_ || pixel_count_[lane] > kMost) return trace();
  const Rays seen(rays, tiles_.camera());
  Nearest nearest;
  for (size_t k = 0; k < pixel_count_[lane]; ++k) {
    const Candidate& c = candidates_[in_pixel_[lane * per_pixel_ + k]];
    const auto [w0, w1, w2] = c.weights(seen);
    // A triangle that is seen nearly edge-on may turn its other side while the camera moves.
    const Int8 inside =
        (simd::min(simd::min(w0, w1), w2) >= 0.f) | (simd::max(simd::max(w0, w1), w2) <= 0.f);
    const LinearForm& inverse_depth = c.placed.inverse_depth;
    const Float8 inverse =
        dot(inverse_depth, seen.direction) / (1.f - dot(inverse_depth, seen.start));
    const Int8 nearer = inside & (inverse > nearest.inverse_depth);
    nearest.inverse_depth = simd::select(nearer, inverse, nearest.inverse_depth);
    nearest.triangle =
        simd::select(nearer, splat(static_cast<int>(c.placed.triangle)), nearest.triangle);
    nearest.weight0 = simd::select(nearer, w0, nearest.weight0);
    nearest.weight1 = simd::select(nearer, w1, nearest.weight1);
    nearest.weight2 = simd::select(nearer, w2, nearest.weight2);
  }
  // Behind what the pixels show there may be more than the candidates.
  if (simd::bits((nearest.triangle < splat(0)) |
                 (nearest.inverse_depth < kSurelyBehind * chosen_farthest_)) != 0)
    return trace();
  const Float8 sum = nearest.weight0 + nearest.weight1 + nearest.weight2;
  PacketHits hits;
  hits.mask = splat(-1);
  hits.t = splat(1.f) / nearest.inverse_depth;
  hits.u = nearest.weight1 / sum;
  hits.v = nearest.weight2 / sum;
  hits.normal = simd::splat3(0, 0, 1);
  hits.triangle = nearest.triangle;
  return hits;
}

}  // namespace diorama
