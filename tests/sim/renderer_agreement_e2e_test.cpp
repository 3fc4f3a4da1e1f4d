// The ray and the raster renderer on frames of a real scene: what they see is the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "sim/simulator.h"

namespace diorama {
namespace {

constexpr int kFrames = 20;
constexpr double kDepth_m = 0.0005;

// Whether a surface ends between b and c, of four pixels a b c d in a line: another instance, or a
// step in inverse depth (linear on a plane) far beyond the steps beside it.
bool surfaceEnds(const GroundTruth& truth, const std::array<size_t, 4>& line) {
  const auto [a, b, c, d] = line;
  if (truth.instance_id.pixels[b] != truth.instance_id.pixels[c]) return true;
  const auto w = [&](size_t i) {
    const double z = static_cast<double>(truth.depth_m.pixels[i]);
    return z > 0 ? 1 / z : 0.0;
  };
  constexpr double kSteep = 3, kStep_m = 0.001;
  const double beside = std::max(std::abs(w(a) - w(b)), std::abs(w(c) - w(d)));
  return std::abs(w(b) - w(c)) > kSteep * beside + kStep_m * w(b) * w(b);
}

// Pixels that are more than one pixel away from any silhouette.
Image<uint8_t> insideOfSurfaces(const GroundTruth& truth) {
  const int width = truth.depth_m.width, height = truth.depth_m.height;
  Image<uint8_t> inside(width, height);
  for (uint8_t& pixel : inside.pixels) pixel = 1;
  const auto spoil = [&](int x0, int y0) {
    for (int y = std::max(0, y0 - 1); y <= std::min(height - 1, y0 + 1); ++y)
      for (int x = std::max(0, x0 - 1); x <= std::min(width - 1, x0 + 1); ++x) inside(x, y) = 0;
  };
  const auto at = [&](int x, int y) {
    return static_cast<size_t>(std::clamp(y, 0, height - 1)) * static_cast<size_t>(width) +
           static_cast<size_t>(std::clamp(x, 0, width - 1));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (x + 1 < width &&
          surfaceEnds(truth, {at(x - 1, y), at(x, y), at(x + 1, y), at(x + 2, y)})) {
        spoil(x, y);
        spoil(x + 1, y);
      }
      if (y + 1 < height &&
          surfaceEnds(truth, {at(x, y - 1), at(x, y), at(x, y + 1), at(x, y + 2)})) {
        spoil(x, y);
        spoil(x, y + 1);
      }
    }
  return inside;
}

class RendererAgreement : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Cameras, RendererAgreement, ::testing::Values("pinhole", "distorted"),
                         [](const auto& info) { return std::string(info.param); });

TEST_P(RendererAgreement, OnFramesOfTheCartonOnTheDesk) {
  ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
  Scene scene = loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml");
  if (GetParam() == std::string("pinhole")) {
    scene.camera.model = CameraModel::kPinhole;
    scene.camera.distortion.clear();
  }
  Simulator ray(scene, {RenderQuality::kDraft});
  Simulator raster(scene, {.quality = RenderQuality::kDraft, .renderer = RendererKind::kRaster});
  size_t inside = 0, same_id = 0, apart = 0;
  double worst_m = 0;
  for (int k = 0; k < kFrames; ++k) {
    const int frame = k * scene.frameCount() / kFrames;
    const auto a = ray.read(frame).truth, b = raster.read(frame).truth;
    const Image<uint8_t> inner = insideOfSurfaces(*a);
    for (size_t i = 0; i < inner.pixels.size(); ++i) {
      if (!inner.pixels[i]) continue;
      ++inside;
      if (a->instance_id.pixels[i] != b->instance_id.pixels[i]) continue;
      ++same_id;
      const double off = std::abs(static_cast<double>(a->depth_m.pixels[i] - b->depth_m.pixels[i]));
      apart += off > kDepth_m;
      worst_m = std::max(worst_m, off);
    }
  }
  std::printf("%s: %zu pixels, %zu with another id, %zu with a depth that is off (worst %.2f mm)\n",
              GetParam(), inside, inside - same_id, apart, 1e3 * worst_m);
  EXPECT_GT(inside, 0.7 * kFrames * scene.camera.width * scene.camera.height);
  EXPECT_GE(static_cast<double>(same_id), 0.999 * static_cast<double>(inside));
  EXPECT_LE(static_cast<double>(apart), 1e-6 * static_cast<double>(inside));  // rays along an edge
}

}  // namespace
}  // namespace diorama
