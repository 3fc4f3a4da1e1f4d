// Hits among a tile's candidates against traced rays.
#include "sim/sample_candidates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "core/random.h"
#include "sim/sample_pattern.h"

namespace diorama {
namespace {

struct Count {
  int rays = 0, other = 0;
};

// Every pixel is rough; samples lie in it, and start up to `way_m` from the camera.
Count compare(const RenderScene& scene, const Camera& camera, const SE3& T_world_camera,
              double way_m, const Random& random) {
  const RayTable table(camera);
  const CameraFrame frame(T_world_camera);
  WorkerPool pool(1);
  TriangleTiles tiles(scene, table, 4);
  tiles.sort(frame, pool, 2 * way_m);
  TruthBuffer truth(table.paddedWidth(), table.paddedHeight());
  TileHits hits;
  for (int tile = 0; tile < table.tileCount(); ++tile) {
    tiles.meet(tile, hits);
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketHits& found = hits[static_cast<size_t>(p)];
      const simd::Int8 valid = simd::maskOfBits(table.packet(tile, p).valid);
      truth.put(table.packetX(tile, p), table.packetY(tile, p),
                simd::select(found.mask, found.t, simd::splat(0.f)), found.triangle,
                simd::select(valid, simd::splat(TruthBuffer::kNothing),
                             simd::splat(TruthBuffer::kUnknown)));
    }
  }
  Count count;
  SampleCandidates candidates(scene, table, tiles);
  for (int tile = 0; tile < table.tileCount(); ++tile) {
    RoughPixels rough;
    for (int p = 0; p < kPacketsPerTile; ++p)
      rough[static_cast<size_t>(p)] = table.packet(tile, p).valid;
    candidates.gather(tile, {3, 2.5, 2.5}, rough, truth);
    for (int p = tile % 5; p < kPacketsPerTile; p += 5) {
      const PacketRays& packet = table.packet(tile, p);
      const int lane = p % 8;
      if (!(packet.valid >> lane & 1)) continue;
      candidates.choose(p, packet.valid);
      SampleLanes samples;
      for (int k = 0; k < 8; ++k) {
        const auto draw = [&](uint64_t which) {
          return random.uniform(static_cast<uint64_t>(tile * kPacketsPerTile + p),
                                static_cast<uint64_t>(k) * 4 + which)[0] -
                 0.5;
        };
        const Vector3d start = frame.origin + 2 * way_m * draw(0) * Vector3d(0.8, 0.36, 0.48);
        const auto put = [&](simd::Vector8& v, const Vector3d& from) {
          v.x[k] = static_cast<float>(from.x());
          v.y[k] = static_cast<float>(from.y());
          v.z[k] = static_cast<float>(from.z());
        };
        put(samples.origin, start);
        put(samples.axis_x, frame.R.col(0));
        put(samples.axis_y, frame.R.col(1));
        put(samples.axis_z, frame.R.col(2));
        samples.du[k] = static_cast<float>(draw(1));
        samples.dv[k] = static_cast<float>(draw(2));
      }
      const RayPacket rays = raysOf(packet, static_cast<size_t>(lane), samples);
      const PacketHits found = candidates.of(lane).closest(rays),
                       traced = scene.bvh->closest(rays, simd::splat(-1), simd::splat(0.f), false);
      for (int k = 0; k < 8; ++k) {
        ++count.rays;
        const bool near = std::abs(found.t[k] / traced.t[k] - 1) < 1e-4f;
        count.other += found.mask[k] != traced.mask[k] || (found.mask[k] != 0 && !near);
        if (found.mask[k] == 0 || found.triangle[k] != traced.triangle[k]) continue;
        EXPECT_NEAR(found.u[k], traced.u[k], 0.02f);
        EXPECT_NEAR(found.v[k], traced.v[k], 0.02f);
      }
    }
  }
  return count;
}

// From places in the room; the camera moves by what 2.5 px of motion allow 0.4 m away.
TEST(SampleCandidates, MeetWhatRaysMeet) {
  ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
  const RenderScene scene =
      makeRenderScene(loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml"));
  const CameraParameters lens{CameraModel::kRadTan,           330, 250, 270, 272, 163, 122,
                              {-0.11, 0.045, 0.0006, -0.0004}};
  const Random random(2, RandomStream::kTest);
  for (uint64_t k = 0; k < 8; ++k) {
    const auto between = [&](uint64_t which, double low, double high) {
      return low + (high - low) * random.uniform(1u << 30, 8 * k + which)[0];
    };
    Vector6d turn;
    turn << 0, 0, 0, between(0, -3, 3), between(1, -3, 3), between(2, -3, 3);
    SE3 T = exp(turn);
    T.translation = Vector3d(between(3, -0.7, 0.7), between(4, -0.4, 0.4), between(5, 0.9, 1.4));
    const Count count = compare(scene, Camera(lens), T, 0.001, random);
    EXPECT_GT(count.rays, 16000);
    EXPECT_LT(count.other, 2e-4 * count.rays);
  }
}

}  // namespace
}  // namespace diorama
