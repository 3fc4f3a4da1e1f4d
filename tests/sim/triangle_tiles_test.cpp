// Hits found tile by tile against traced rays.
#include "sim/triangle_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/random.h"

namespace diorama {
namespace {

struct Count {
  int rays = 0, other = 0;  // hits of another surface
  double worst = 0;         // difference of depth, relative
};

// Rays that graze an outline may pass it on either side.
Count compare(const RenderScene& scene, const Camera& camera, const SE3& T_world_camera) {
  const RayTable table(camera);
  const CameraFrame frame(T_world_camera);
  WorkerPool pool(1);
  TriangleTiles tiles(scene, table);
  tiles.sort(frame, pool);
  Count count;
  TileHits hits;
  for (int tile = 0; tile < table.tileCount(); ++tile) {
    tiles.meet(tile, hits);
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketRays& packet = table.packet(tile, p);
      const PacketHits& found = hits[static_cast<size_t>(p)];
      const RayPacket rays = frame.rays(simd::load(packet.x), simd::load(packet.y));
      const PacketHits traced =
          scene.bvh->closest(rays, simd::maskOfBits(packet.valid), simd::splat(0.f), false);
      for (int lane = 0; lane < 8; ++lane) {
        if (!(packet.valid >> lane & 1)) {
          EXPECT_EQ(found.mask[lane], 0);
          continue;
        }
        ++count.rays;
        if (found.mask[lane] != traced.mask[lane]) {
          ++count.other;
        } else if (found.mask[lane] != 0) {
          const double apart = std::abs(static_cast<double>(found.t[lane] / traced.t[lane]) - 1);
          if (found.triangle[lane] != traced.triangle[lane] && apart > 1e-4) {
            ++count.other;
            continue;
          }
          count.worst = std::max(count.worst, apart);
          if (found.triangle[lane] != traced.triangle[lane]) continue;
          EXPECT_NEAR(found.u[lane], traced.u[lane], 0.02f);
          EXPECT_NEAR(found.v[lane], traced.v[lane], 0.02f);
        }
      }
    }
  }
  return count;
}

// Also from inside objects and close to walls, where triangles reach behind the camera.
TEST(TriangleTiles, MeetWhatRaysMeet) {
  ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
  const Scene scene = loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml");
  const RenderScene triangles = makeRenderScene(scene);
  const CameraParameters lens{CameraModel::kRadTan,           330, 250, 270, 272, 163, 122,
                              {-0.11, 0.045, 0.0006, -0.0004}};
  const CameraParameters fisheye{CameraModel::kFisheye,       330, 250, 110, 112, 163, 122,
                                 {0.02, -0.01, 0.004, -0.001}};
  const Random random(1, RandomStream::kTest);
  for (uint64_t k = 0; k < 12; ++k) {
    const auto between = [&](uint64_t which, double low, double high) {
      return low + (high - low) * random.uniform(0, 8 * k + which)[0];
    };
    Vector6d turn;
    turn << 0, 0, 0, between(0, -3, 3), between(1, -3, 3), between(2, -3, 3);
    SE3 T = exp(turn);
    T.translation = Vector3d(between(3, -0.7, 0.7), between(4, -0.4, 0.4), between(5, 0.7, 1.4));
    for (const CameraParameters& k_lens : {lens, fisheye}) {
      const Count count = compare(triangles, Camera(k_lens), T);
      EXPECT_GT(count.rays, 60000);
      EXPECT_LT(count.other, 1e-4 * count.rays);
      EXPECT_LT(count.worst, 1e-4);
    }
  }
}

}  // namespace
}  // namespace diorama
