// What textures tell of an object.
#include "tracker/print.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"
#include "tests/tracker/box_scene.h"
#include "tests/tracker/pose_checks.h"
#include "tracker/edge_model.h"
#include "tracker/health.h"
#include "tracker/object_tracker.h"
#include "tracker/texture_cue.h"

namespace diorama {
namespace {

constexpr double kTexel = 0.0005;  // m

struct PrintTest : testing::Test {
  test::TemporaryFolder folder;
  test::BoxScene scene;
  TrackerOptions options;
  Mesh mesh = printedMesh();
  EdgeModel model = makeEdgeModel(mesh, options);
  SE3 T = poseOf(0);

  SE3 poseOf(double t) const {
    return test::boxPose(t) * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  }
  Print print() const { return {mesh, model.centre_object, scene.camera, scene.rays, 0}; }

  // The box with its print in six images.
  Mesh printedMesh() {
    Mesh box = test::boxMesh(scene.box);
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        Material material;
        material.texture = folder / (std::to_string(2 * axis + side) + ".pgm");
        writeSide(material.texture, axis, side);
        box.materials.push_back(material);
        for (int k = 0; k < 2; ++k) box.triangle_materials.push_back(2 * axis + side);
        for (int corner = 0; corner < 4; ++corner)
          box.uvs.emplace_back(corner == 1 || corner == 2 ? 1 : 0, corner >= 2 ? 1 : 0);
      }
    return box;
  }

  void writeSide(const std::filesystem::path& file, int axis, int side) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const Vector3d size = scene.box.high - scene.box.low;
    const int width = static_cast<int>(size[u] / kTexel),
              height = static_cast<int>(size[v] / kTexel);
    std::ofstream out(file, std::ios::binary);
    out << "P5\n" << width << ' ' << height << "\n255\n";
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        Vector3d p = scene.box.low;
        p[u] += (x + 0.5) * kTexel;
        p[v] = scene.box.high[v] - (y + 0.5) * kTexel;
        out.put(static_cast<char>(scene.printAt(p, axis, side)));
      }
  }

  TextureCue cueWith(const std::vector<Patch>& patches) const {
    TextureCue cue(model, scene.camera, scene.rays, 0, options, options.print_correlation);
    cue.setPatches(patches, T);
    return cue;
  }
};

TEST_F(PrintTest, AloneFindsThePose) {
  TextureCue cue = cueWith(print().patchesSeenFrom(T, 40));
  const SE3 truth = poseOf(0.1);
  const Frame frame = scene.draw(test::boxPose(0.1), 0);
  const SE3 pose = test::poseByPatches(cue, frame.gray, truth, model.diameter);
  EXPECT_LT(test::pixelError(scene.camera, model, pose, truth), 0.25);
  EXPECT_GE(cue.agreement(1.5).agreeing, 15);
}

TEST_F(PrintTest, PatchesLieOnOneSideEachAndApart) {
  const std::vector<Patch> patches = print().patchesSeenFrom(T, 40);
  ASSERT_GE(patches.size(), 15u);
  for (const Patch& patch : patches) {
    const Vector3d p = patch.p + model.centre_object;
    const Vector3d room = (p - scene.box.low).cwiseMin(scene.box.high - p);  // to the six sides
    std::array<double, 3> sorted{room.x(), room.y(), room.z()};
    std::sort(sorted.begin(), sorted.end());
    EXPECT_LT(sorted[0], 1e-6);
    EXPECT_GT(sorted[1], 3 * std::min(patch.along_x.norm(), patch.along_y.norm()));
    for (const Patch& other : patches) {
      const Vector2d apart =
          *scene.camera.project(T * patch.p) - *scene.camera.project(T * other.p);
      EXPECT_TRUE(&other == &patch || apart.norm() > 9);
    }
  }
  EXPECT_LE(print().patchesSeenFrom(T, 5).size(), 5u);
}

TEST_F(PrintTest, WithoutTexturesNothingIsKnown) {
  EXPECT_FALSE(print().empty());
  EXPECT_TRUE(print().isKnown(3));
  EXPECT_FALSE(print().isKnown(-1));
  const std::string huge = "P5\n99999999 99999999\n255\nx";
  for (const std::string& content : {std::string(), std::string("no image"), huge}) {
    for (const Material& material : mesh.materials)
      std::ofstream(material.texture, std::ios::binary) << content;
    EXPECT_TRUE(print().empty()) << content;
    EXPECT_FALSE(print().isKnown(3));
  }
  for (Material& material : mesh.materials) material.texture = folder / "missing.png";
  EXPECT_TRUE(print().empty());
  mesh = test::boxMesh();
  EXPECT_TRUE(print().empty());
  EXPECT_TRUE(print().patchesSeenFrom(T, 40).empty());
}

// Coordinates that are out of the texture, that run backwards, or that are not numbers.
TEST_F(PrintTest, StrangeCoordinatesGiveFewerPatches) {
  const size_t usual = print().patchesSeenFrom(T, 40).size();
  const Mesh good = mesh;
  for (const float factor : {-1.f, 50.f, 1e30f, 0.f, std::numeric_limits<float>::quiet_NaN()}) {
    mesh = good;
    for (Eigen::Vector2f& uv : mesh.uvs) uv = factor * uv;
    EXPECT_LT(print().patchesSeenFrom(T, 40).size(), usual) << factor;
  }
}

TEST_F(PrintTest, ProvesAPoseOrSpeaksAgainstIt) {
  TextureCue cue = cueWith(print().patchesSeenFrom(T, 40));
  const TextureCue none(model, scene.camera, scene.rays, 0, options, 1);
  EdgeObservation found;
  found.contour = true;
  found.u_px = found.normal = Vector2d::Zero();
  found.candidate_count = 1;
  found.candidates[0] = {0, {30, 0, 0}, true};
  const std::vector<EdgeObservation> half(25, found);
  const auto health = [&](bool absent) {
    cue.align(scene.draw(test::boxPose(), 0, absent).gray, T, {});
    cue.linearise(T);
    return assessHealth({50, 0}, half, none, cue, options).value;
  };
  EXPECT_GT(health(false), 0.6);
  EXPECT_LT(health(true), 0.4);
}

// Something with a print of its own, in the object's greys, passes before it. Patches of keyframes
// would take its print for the object's.
TEST_F(PrintTest, IsNotThatOfAThingInFront) {
  const auto meanError = [&](int print_patches) {
    TrackerOptions chosen = options;
    chosen.print_patches = print_patches;
    EdgeTracker tracker({"box", mesh, {}}, scene.camera, std::make_shared<test::BoxRays>(scene.box),
                        0, chosen);
    double sum = 0;
    constexpr int kFrames = 40;
    for (int i = 0; i < kFrames; ++i) {
      const SE3 truth = test::boxPose(0.03 * i);
      Frame frame = scene.draw(truth, i);
      const int left = 3 * i;
      for (int y = 0; y < frame.gray.height; ++y)
        for (int x = left; x < std::min(left + 70, frame.gray.width); ++x) {
          const double p = test::pattern(x - left, y, 25, 8);
          frame.gray(x, y) = p > 0.2 ? 190 : p < -0.2 ? 110 : 150;
        }
      const auto start =
          i == 0 ? std::optional(ObjectPrediction{truth, Matrix6d::Identity()}) : std::nullopt;
      const ObjectMeasurement m = tracker.track(frame, start);
      sum += std::min(0.05, (m.T_camera_object.translation - truth.translation).norm());
    }
    return sum / kFrames;
  };
  const double with = meanError(30), without = meanError(0);
  std::printf("mean error with the print %.2f mm, without %.2f mm\n", 1e3 * with, 1e3 * without);
  EXPECT_LT(with, 0.002);
  EXPECT_LT(with, 0.7 * without);
}

}  // namespace
}  // namespace diorama
