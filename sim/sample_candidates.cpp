#include "sim/sample_candidates.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

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
  Int8 place = splat(-1);  // among the candidates
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
  return {t, t.side * (p2 - p1), t.side * (p0 - p2), t.side * (p1 - p0)};
}

void SampleCandidates::choose(int p, int lanes) {
  pixel_count_.fill(0);
  if (!gathered_) return;
  const PacketRays& packet = table_.packet(tile_, p);
  const Float8 x = simd::load(packet.x), y = simd::load(packet.y);
  const Float8 half_x = splat(margin_x_), half_y = splat(margin_y_);
  const size_t block = blockOf(p);
  chosen_farthest_ = farthest_[block / kTileBlocks][static_cast<int>(block % kTileBlocks)];
  for (const uint32_t place : in_block_[block]) {
    const PlacedTriangle& t = candidates_[place].placed;
    const Int8 in_box = (x <= t.box.x1 + margin_x_) & (x >= t.box.x0 - margin_x_) &
                        (y <= t.box.y1 + margin_y_) & (y >= t.box.y0 - margin_y_);
    if ((simd::bits(in_box) & lanes) == 0) continue;
    const auto most = [&](const LinearForm& f) { return f.most(x, y, half_x, half_y); };
    const Float8 inside = simd::min(simd::min(most(t.weight0), most(t.weight1)), most(t.weight2));
    const Int8 touched =
        in_box & (inside >= 0.f) & (most(t.inverse_depth) >= kBehind * chosen_farthest_);
    for (auto rest = static_cast<unsigned>(simd::bits(touched) & lanes); rest != 0;
         rest &= rest - 1) {
      const auto lane = static_cast<size_t>(__builtin_ctz(rest));
      if (pixel_count_[lane] < kMost) in_pixel_[lane][pixel_count_[lane]] = place;
      ++pixel_count_[lane];
    }
  }
}

PacketHits SampleCandidates::closest(size_t lane, const RayPacket& rays) const {
  const auto trace = [&] { return scene_.quick_bvh->closest(rays, splat(-1), splat(0.f), true); };
  if (!gathered_ || pixel_count_[lane] > kMost) return trace();
  const Rays seen(rays, tiles_.camera());
  Nearest nearest;
  for (size_t k = 0; k < pixel_count_[lane]; ++k) {
    const uint32_t place = in_pixel_[lane][k];
    const Candidate& c = candidates_[place];
    const auto [w0, w1, w2] = c.weights(seen);
    // A triangle that is seen nearly edge-on may turn its other side while the camera moves.
    const Int8 inside =
        (simd::min(simd::min(w0, w1), w2) >= 0.f) | (simd::max(simd::max(w0, w1), w2) <= 0.f);
    const LinearForm& inverse_depth = c.placed.inverse_depth;
    const Float8 inverse =
        dot(inverse_depth, seen.direction) / (1.f - dot(inverse_depth, seen.start));
    const Int8 nearer = inside & (inverse > nearest.inverse_depth);
    nearest.inverse_depth = simd::select(nearer, inverse, nearest.inverse_depth);
    nearest.place = simd::select(nearer, splat(static_cast<int>(place)), nearest.place);
  }
  // Behind what the pixels show there may be more than the candidates.
  if (simd::bits((nearest.place < splat(0)) |
                 (nearest.inverse_depth < kSurelyBehind * chosen_farthest_)) != 0)
    return trace();
  return hitsOf(nearest, seen);
}

PacketHits SampleCandidates::hitsOf(const Nearest& nearest, const Rays& rays) const {
  PacketHits hits;
  hits.mask = splat(-1);
  hits.t = splat(1.f) / nearest.inverse_depth;
  hits.u = hits.v = splat(0.f);
  hits.normal = simd::splat3(0, 0, 1);
  hits.triangle = splat(0);
  for (unsigned pending = 0xff; pending != 0;) {
    const int place = nearest.place[__builtin_ctz(pending)];
    const Candidate& c = candidates_[static_cast<size_t>(place)];
    const uint32_t triangle = c.placed.triangle;
    const Int8 lanes = nearest.place == splat(place);
    const auto [w0, w1, w2] = c.weights(rays);
    const Float8 sum = w0 + w1 + w2;
    hits.u = simd::select(lanes, w1 / sum, hits.u);
    hits.v = simd::select(lanes, w2 / sum, hits.v);
    hits.triangle = simd::select(lanes, splat(static_cast<int>(triangle)), hits.triangle);
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
  }
  return hits;
}

}  // namespace diorama
