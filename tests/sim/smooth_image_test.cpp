// Where the ray renderer takes the image as smooth, and how it samples where it is not.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim/patches.h"
#include "sim/sample_pattern.h"
#include "sim/truth_buffer.h"

namespace diorama {
namespace {

// Triangles over numbered corners, each with a material.
RenderScene sceneOf(size_t corners, std::vector<uint32_t> indices, std::vector<int> materials) {
  RenderScene scene;
  scene.corners.resize(corners);
  scene.indices = std::move(indices);
  for (const int material : materials) {
    ShadingTriangle t;
    t.material = material;
    scene.triangles.push_back(t);
  }
  return scene;
}

TEST(Patches, TrianglesThatShareCornersAndMaterial) {
  // A strip of two; one beyond it that touches with a corner; the strip's third in another paint;
  // one apart.
  RenderScene scene = sceneOf(10, {0, 1, 2, 2, 1, 3, 3, 4, 5, 2, 3, 6, 7, 8, 9}, {0, 0, 0, 1, 0});
  findPatches(scene);
  const auto patch = [&](size_t k) { return scene.triangles[k].patch; };
  EXPECT_GT(patch(0), TruthBuffer::kNothing);
  EXPECT_EQ(patch(0), patch(1));
  EXPECT_EQ(patch(0), patch(2));
  EXPECT_NE(patch(0), patch(3));
  EXPECT_NE(patch(0), patch(4));
  EXPECT_NE(patch(3), patch(4));
}

// A buffer of 32 x 32 pixels; `patch` and `depth` are functions of the pixel.
template <class Patch, class Depth>
TruthBuffer bufferOf(const Patch& patch, const Depth& depth) {
  TruthBuffer buffer(32, 32);
  for (int y = 0; y < 32; y += 2)
    for (int x = 0; x < 32; x += 4) {
      simd::Int8 patches;
      simd::Float8 depths;
      for (int lane = 0; lane < 8; ++lane) {
        patches[lane] = patch(x + laneX(lane), y + laneY(lane));
        depths[lane] = depth(x + laneX(lane), y + laneY(lane));
      }
      buffer.put(x, y, depths, simd::splat(1), patches);
    }
  return buffer;
}

TEST(TruthBuffer, RoughPixelsNearABorder) {
  // The border between two patches runs between columns 13 and 14.
  const TruthBuffer buffer =
      bufferOf([](int x, int) { return x < 14 ? 1 : 2; }, [](int, int) { return 1.f; });
  const auto isRough = [&](int x, int y, Reach reach) {
    const int x0 = x / 4 * 4, y0 = y / 2 * 2;
    return (buffer.roughPixels(x0, y0, reach, 32, 32) >> (x - x0 + 4 * (y - y0)) & 1) != 0;
  };
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      EXPECT_EQ(isRough(x, y, {1, 1}), x == 13 || x == 14) << x << ' ' << y;
      EXPECT_EQ(isRough(x, y, {3, 1}), 11 <= x && x <= 16) << x << ' ' << y;
    }
}

TEST(TruthBuffer, TheFarthestOfWhatIsAround) {
  const TruthBuffer buffer = bufferOf([](int, int y) { return y < 4 ? TruthBuffer::kNothing : 1; },
                                      [](int x, int y) {
                                        return y < 4 ? 0.f : x < 16 ? 2.f : 4.f;
                                      });
  EXPECT_EQ(buffer.leastInverseDepth(8, 8, {1, 1}), 0.5f);
  EXPECT_EQ(buffer.leastInverseDepth(12, 8, {1, 1}), 0.25f);
  EXPECT_EQ(buffer.leastInverseDepth(8, 4, {1, 1}), 0);
  const TruthBuffer outside =
      bufferOf([](int x, int) { return x < 16 ? 1 : TruthBuffer::kUnknown; },
               [](int x, int) { return x < 16 ? 2.f : 0.f; });
  EXPECT_EQ(outside.leastInverseDepth(12, 8, {1, 1}), 0.5f);  // where there is no ray
}

TEST(TruthBuffer, PlanesAreSmoothAndBallsAreNotAtTheirLimb) {
  const auto one = [](int, int) { return 1; };
  const TruthBuffer plane = bufferOf(one, [](int x, int y) {
    return 1 / (1 + 0.02f * static_cast<float>(x) + 0.01f * static_cast<float>(y));
  });
  const auto height = [](int x, int y) {  // of a ball of 12 px, 500 px in front of a camera
    const double r2 = std::pow(x - 15.5, 2) + std::pow(y - 15.5, 2);
    return static_cast<float>(1 - (r2 < 144 ? std::sqrt(144 - r2) : 0) / 500);
  };
  const TruthBuffer ball = bufferOf(one, height);
  for (int y = 0; y < 32; y += 2)
    for (int x = 0; x < 32; x += 4) EXPECT_EQ(plane.roughPixels(x, y, {2, 2}, 32, 32), 0);
  EXPECT_NE(ball.roughPixels(4, 16, {2, 2}, 32, 32), 0);
  EXPECT_EQ(ball.roughPixels(16, 16, {2, 2}, 32, 32), 0);
}

// The part of the samples on one side of an edge that moves while it crosses the pixel.
double covered(const std::vector<PixelSample>& samples, double nx, double ny, double way) {
  int count = 0;
  for (const PixelSample& s : samples)
    count += nx * static_cast<double>(s.du) + ny * static_cast<double>(s.dv) +
                 way * static_cast<double>(s.origin.x()) <
             0.1;
  return static_cast<double>(count) / static_cast<double>(samples.size());
}

// Each in a quarter of its own of the pixel's width, of its height and of the exposure.
TEST(SamplePattern, FourTapsShareThePixelOut) {
  WorkerPool pool(1);
  ExposureMotion motion;
  motion.exposure_s = 1;
  motion.T_world_camera = [](double t) {
    SE3 pose;
    pose.translation.x() = t;
    return pose;
  };
  const SamplePattern pattern = MovingPattern({8, 0.5f, 4, 0.6f}, motion, 10, pool)[0];
  ASSERT_EQ(pattern.taps.size(), 4u);
  std::array<int, 3> quarters{};
  for (const PixelSample& tap : pattern.taps) {
    const Vector3f at(tap.du, tap.dv, tap.origin.x());
    for (int axis = 0; axis < 3; ++axis)
      quarters[static_cast<size_t>(axis)] |= 1 << static_cast<int>((at[axis] + 0.5f) * 4);
  }
  EXPECT_EQ(quarters, (std::array<int, 3>{15, 15, 15}));
}

TEST(SamplePattern, TellsTheCoveredPartOfAPixel) {
  WorkerPool pool(1);
  ExposureMotion motion;
  motion.exposure_s = 1;  // the origin's x tells the moment
  motion.T_world_camera = [](double t) {
    SE3 pose;
    pose.translation.x() = t;
    return pose;
  };
  for (const int count : {8, 16, 32}) {
    const SamplePattern pattern = MovingPattern({count, 0.5f, count, 0.5f}, motion, 10, pool)[0];
    ASSERT_EQ(pattern.base.size(), static_cast<size_t>(count));
    ASSERT_EQ(pattern.extra.size(), static_cast<size_t>(count));
    std::vector<PixelSample> all = pattern.base;
    all.insert(all.end(), pattern.extra.begin(), pattern.extra.end());
    Vector3f sum = Vector3f::Zero();
    for (size_t k = 0; k < all.size(); ++k) {
      sum += Vector3f(all[k].du, all[k].dv, all[k].origin.x());
      const SampleLanes& lanes =
          (k < pattern.base.size() ? pattern.base_lanes
                                   : pattern.extra_lanes)[k % static_cast<size_t>(count) / 8];
      EXPECT_EQ(lanes.du[k % 8], all[k].du);
      EXPECT_EQ(lanes.origin.x[k % 8], all[k].origin.x());
      EXPECT_EQ(lanes.dither[k % 8], all[k].dither);
    }
    EXPECT_LT(sum.norm(), 1e-5f);  // edges stay where they are
    double worst = 0;
    for (int k = 0; k < 64; ++k)
      for (const double way : {0.0, 1.0, 2.0, 4.0}) {
        const double nx = std::cos(k * M_PI / 32), ny = std::sin(k * M_PI / 32);
        constexpr int kFine = 40;
        int inside = 0;
        for (int i = 0; i < kFine * kFine * kFine; ++i) {
          const auto at = [&](int j) { return (j % kFine + 0.5) / kFine - 0.5; };
          inside += nx * at(i) + ny * at(i / kFine) + way * at(i / kFine / kFine) < 0.1;
        }
        worst = std::max(worst, std::abs(covered(all, nx, ny, way) - inside / std::pow(kFine, 3)));
      }
    EXPECT_LT(worst, 0.5 / std::sqrt(count)) << count;
  }
}

}  // namespace
}  // namespace diorama
