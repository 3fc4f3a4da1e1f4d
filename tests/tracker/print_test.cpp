// What textures tell of an object.
#include "tracker/print.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

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

char byteOf(double grey) { return static_cast<char>(static_cast<uint8_t>(grey)); }

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
        out.put(byteOf(scene.printAt(p, axis, side)));
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

// An upright tube about the z axis with a label all around, seen from the side.
struct RoundLabel {
  static constexpr double kRadius = 0.035, kHeight = 0.12;  // m
  static constexpr int kSides = 720;                        // its triangles differ by 1 um
  Camera camera{CameraParameters{CameraModel::kRadTan, 320, 240, 300, 300, 160, 120, {0, 0, 0, 0}}};
  SE3 T{expSO3(Vector3d(1.9, 0, 0)), Vector3d(0.01, 0.03, 0.3)};

  struct Rays : RayQuery {
    void occluded(int object, const Vector3d& origin, std::span<const Vector3d> points,
                  std::span<uint8_t> hidden) const override {
      for (size_t k = 0; k < points.size(); ++k) {
        const auto hit = closestHit(object, origin, points[k] - origin);
        hidden[k] = hit && (hit->p_object - origin).norm() < 0.999 * (points[k] - origin).norm();
      }
    }
    std::optional<RayHit> closestHit(int, const Vector3d& origin,
                                     const Vector3d& direction) const override {
      const Vector2d o = origin.head<2>(), d = direction.head<2>();
      const double a = d.squaredNorm(), b = o.dot(d);
      const double root = b * b - a * (o.squaredNorm() - kRadius * kRadius);
      if (!(root > 0)) return std::nullopt;
      const Vector3d p = origin + (-b - std::sqrt(root)) / a * direction;
      if (p.z() < 0 || p.z() > kHeight) return std::nullopt;
      const int side = static_cast<int>(turns(p) * kSides);
      return RayHit{p, Vector3d(p.x(), p.y(), 0).normalized(), 2 * std::min(side, kSides - 1)};
    }
  } rays;

  static double turns(const Vector3d& p) {
    return std::atan2(p.y(), p.x()) / (2 * std::numbers::pi) + 0.5;
  }
  static double greyAt(double turns, double z) {
    const double p = test::pattern(2 * std::numbers::pi * kRadius * turns, z, 0.02, 3);
    return p > 0.1 ? 200 : p < -0.1 ? 60 : 130;
  }

  Mesh mesh(const std::filesystem::path& label) const {
    Mesh tube;
    Material material;
    material.texture = label;
    tube.materials.push_back(material);
    for (int k = 0; k <= kSides; ++k) {
      const double share = static_cast<double>(k) / kSides;
      const double angle = 2 * std::numbers::pi * (share - 0.5);
      for (const double v : {0, 1}) {
        tube.positions.push_back(
            Vector3d(kRadius * std::cos(angle), kRadius * std::sin(angle), v * kHeight)
                .cast<float>());
        tube.uvs.emplace_back(static_cast<float>(share), static_cast<float>(v));
      }
      if (k == kSides) break;
      tube.triangles.emplace_back(2 * k, 2 * k + 2, 2 * k + 3);
      tube.triangles.emplace_back(2 * k, 2 * k + 3, 2 * k + 1);
      tube.triangle_materials.insert(tube.triangle_materials.end(), {0, 0});
    }
    writeLabel(label);
    return tube;
  }

  void writeLabel(const std::filesystem::path& file) const {
    constexpr int kWidth = 880, kRows = 480;
    std::ofstream out(file, std::ios::binary);
    out << "P5\n" << kWidth << ' ' << kRows << "\n255\n";
    for (int y = 0; y < kRows; ++y)
      for (int x = 0; x < kWidth; ++x)
        out.put(byteOf(greyAt((x + 0.5) / kWidth, (1 - (y + 0.5) / kRows) * kHeight)));
  }

  Image<uint8_t> draw() const {
    constexpr int kFine = 3;
    Image<uint8_t> image(camera.width(), camera.height());
    const Vector3d eye = T.inverse().translation;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        double light = 0;
        for (int k = 0; k < kFine * kFine; ++k) {
          const Vector2d u(x + (k % kFine - 1.0) / kFine, y + (k / kFine - 1.0) / kFine);
          const auto hit =
              rays.closestHit(0, eye, T.rotationMatrix().transpose() * *camera.unproject(u));
          light += std::pow(hit ? greyAt(turns(hit->p_object), hit->p_object.z()) : 100, 2);
        }
        image(x, y) = static_cast<uint8_t>(std::sqrt(light / (kFine * kFine)) + 0.5);
      }
    return image;
  }
};

// Patches of a round label lie beside their planes, towards its middle: as planes all of them would
// be found there, as if the label were smaller and farther away.
TEST_F(PrintTest, FollowsARoundLabel) {
  const RoundLabel label;
  const Print print(label.mesh(folder / "label.pgm"), Vector3d::Zero(), label.camera, label.rays,
                    0);
  std::vector<Patch> patches = print.patchesSeenFrom(label.T, 40);
  const Image<uint8_t> image = label.draw();
  double inwards = 0, squares = 0;
  int found = 0;
  for (Patch& patch : patches) {
    const double side = label.camera.project(label.T * patch.p)->x() -
                        label.camera.project(label.T * Vector3d(0, 0, patch.p.z()))->x();
    patch.align(image, label.camera, label.T, options.patch_correlation);
    if (!patch.found) continue;
    ++found;
    const Vector2d off = patch.u_px - *label.camera.project(label.T * patch.p);
    inwards += off.x() * side / 35;  // px, at the rim
    squares += off.squaredNorm();
  }
  std::printf("round label: %d patches, %.3f px at the rim, %.3f px rms\n", found, inwards / found,
              std::sqrt(squares / found));
  ASSERT_GE(found, 15);
  EXPECT_LT(std::abs(inwards / found), 0.03);
  EXPECT_LT(std::sqrt(squares / found), 0.2);
}

// Its edges are as sharp however it is turned. The print is what tells, and was right from the
// start.
TEST_F(PrintTest, ARoundThingIsNotTurnedByItsEdges) {
  const RoundLabel label;
  EdgeTracker tracker({"tube", label.mesh(folder / "label.pgm"), {}}, label.camera,
                      std::make_shared<RoundLabel::Rays>(), 0, options);
  Frame frame;
  frame.gray = label.draw();
  const ObjectMeasurement m = tracker.track(frame, ObjectPrediction{label.T, Matrix6d::Identity()});
  EXPECT_LT(angleBetween(m.T_camera_object.rotation, label.T.rotation), 0.02);
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
