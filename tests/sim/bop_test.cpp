#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "mutator.h"
#include "sim/bop_reader.h"
#include "sim/bop_writer.h"
#include "sim/mesh_import.h"
#include "sim/png_encoder.h"
#include "sim/sequence_writer.h"
#include "small_scene.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using testing::errorLine;
using ::testing::HasSubstr;
using Json = nlohmann::json;

// Masks made by hand: the object `box` is hidden in part, `small` reaches beyond the image in frame
// 0 and is not seen in the others.
GroundTruth handMade(const Scene& scene, int k) {
  GroundTruth truth;
  truth.timestamp_ns = scene.timestampNs(k);
  truth.T_world_camera = scene.T_world_camera(k);
  truth.depth_m = Image<float>(64, 48, 1.5f);
  truth.instance_id = Image<uint16_t>(64, 48);
  Image<uint8_t> box(64, 48), small(64, 48);
  for (int y = 5; y <= 9; ++y)
    for (int x = 10; x <= 20; ++x) {
      box(x, y) = 255;
      if (x >= 12) truth.instance_id(x, y) = 1;
    }
  truth.depth_m(10, 5) = 0;
  ObjectTruth a{"box", scene.objects[0].T_world_object, 55, 55, 45, box, {}};
  ObjectTruth b{"small", scene.objects[2].T_world_object, 0, 0, 0, small, {}};
  if (k == 0) {
    for (int y = 40; y < 48; ++y)
      for (int x = 0; x < 4; ++x) {
        b.mask(x, y) = 255;
        truth.instance_id(x, y) = 3;
      }
    b.outside = {-6, 42, -1, 50};
    b.px_all = 80;
    b.px_valid = b.px_visible = 32;
  }
  truth.objects = {a, b};
  return truth;
}

class Bop : public testing::SmallScene {
 protected:
  void SetUp() override {
    SmallScene::SetUp();
    scene_ = loadScene(folder_ / "scene.yaml");
    SequenceWriter writer(folder_ / "seq", scene_, {1, 4, {SequenceFormat::kBop}});
    for (int k = 1; k < 4; ++k) {
      Frame frame;
      frame.index = k;
      frame.timestamp_ns = scene_.timestampNs(k);
      frame.rgb = Image<Rgb8>(64, 48, {uint8_t(k), 100, 200});
      frame.gray = toGray(frame.rgb);
      writer.write(frame, handMade(scene_, k - 1));
    }
    writer.finish();
    bop_ = folder_ / "seq/bop/test/000000";
  }
  Json json(const fs::path& file) const { return Json::parse(readFile(file)); }

  Scene scene_;
  fs::path bop_;
};

TEST_F(Bop, CountsAndBoxesAreThoseOfTheToolkit) {
  const Json info = json(bop_ / "scene_gt_info.json");
  ASSERT_EQ(info.size(), 3u);
  const Json& box = info["1"][0];
  EXPECT_EQ(box["px_count_all"], 55);
  EXPECT_EQ(box["px_count_valid"], 54) << "one pixel has no depth";
  EXPECT_EQ(box["px_count_visib"], 45);
  EXPECT_DOUBLE_EQ(box["visib_fract"], 45.0 / 55);
  // x, y of the first pixel; then last minus first.
  EXPECT_THAT(box["bbox_obj"].get<std::vector<int>>(), ElementsAre(10, 5, 10, 4));
  EXPECT_THAT(box["bbox_visib"].get<std::vector<int>>(), ElementsAre(12, 5, 8, 4));
  const Json& small = info["1"][1];
  EXPECT_EQ(small["px_count_all"], 80);
  EXPECT_EQ(small["px_count_valid"], 32);
  EXPECT_THAT(small["bbox_obj"].get<std::vector<int>>(), ElementsAre(-6, 40, 9, 10))
      << "of the whole silhouette, also beyond the image";
  EXPECT_THAT(small["bbox_visib"].get<std::vector<int>>(), ElementsAre(0, 40, 3, 7));
  const Json& hidden = info["3"][1];
  EXPECT_EQ(hidden["px_count_visib"], 0);
  EXPECT_EQ(hidden["visib_fract"], 0);
  EXPECT_THAT(hidden["bbox_obj"].get<std::vector<int>>(), ElementsAre(-1, -1, -1, -1));
  EXPECT_THAT(hidden["bbox_visib"].get<std::vector<int>>(), ElementsAre(-1, -1, -1, -1));
}

TEST_F(Bop, CameraAndPosesAreInMillimetres) {
  const Json camera = json(bop_ / "scene_camera.json")["2"];
  EXPECT_THAT(camera["cam_K"].get<std::vector<double>>(),
              ElementsAre(50, 0, 31.5, 0, 51, 23.5, 0, 0, 1));
  EXPECT_DOUBLE_EQ(camera["depth_scale"], 0.2);
  EXPECT_EQ(camera["distortion_model"], "radtan");
  const Json root = json(folder_ / "seq/bop/camera.json");
  EXPECT_EQ(root["width"], 64);
  EXPECT_DOUBLE_EQ(root["fy"], 51);
  const Json gt = json(bop_ / "scene_gt.json")["2"][0];
  EXPECT_EQ(gt["obj_id"], 1);
  const SE3 expected = scene_.T_world_camera(1).inverse() * scene_.objects[0].T_world_object;
  EXPECT_NEAR(gt["cam_t_m2c"][2], 1000 * expected.translation.z(), 1e-9);
  EXPECT_NEAR(gt["cam_R_m2c"][1], expected.rotationMatrix()(0, 1), 1e-12);
  const Json targets = json(folder_ / "seq/bop/test_targets_bop19.json");
  EXPECT_EQ(targets.size(), 6u);
  EXPECT_EQ(targets[0]["inst_count"], 1);
  for (const char* file : {"rgb/000001.png", "depth/000003.png", "mask/000002_000001.png",
                           "mask_visib/000001_000000.png"})
    EXPECT_TRUE(fs::exists(bop_ / file)) << file;
  EXPECT_FALSE(fs::exists(folder_ / "seq/sequence.yaml"));
}

TEST_F(Bop, ModelsKeepTheirFrameInMillimetres) {
  const Json info = json(folder_ / "seq/bop/models/models_info.json");
  EXPECT_NEAR(info["1"]["diameter"], 1000 * std::sqrt(0.01 + 0.01 + 0.24 * 0.24), 1e-3);
  EXPECT_NEAR(info["1"]["min_x"], -50, 1e-4);
  EXPECT_NEAR(info["1"]["size_z"], 240, 1e-4);
  EXPECT_EQ(info["1"]["name"], "box");
  EXPECT_EQ(info["1"]["symmetries_continuous"][0]["axis"][2], 1);
  const Mesh mesh = importMesh(folder_ / "seq/bop/models/obj_000002.ply", {0.001, false});
  const Mesh small = importMesh(folder_ / "box.obj", {0.5, true});
  EXPECT_EQ(mesh.triangles.size(), small.triangles.size());
  EXPECT_LT((mesh.minCorner() - small.minCorner()).norm(), 1e-6f);
  EXPECT_LT((mesh.maxCorner() - small.maxCorner()).norm(), 1e-6f);
}

TEST_F(Bop, ReadsBackWhatWasWritten) {
  for (const fs::path& path :
       {folder_ / "seq", folder_ / "seq/bop", folder_ / "seq/bop/test", bop_})
    EXPECT_EQ(findBopScene(path).value_or("").lexically_normal(), bop_) << path;
  BopReader reader(bop_);
  EXPECT_EQ(reader.frameCount(), 3);
  EXPECT_EQ(reader.camera().parameters().distortion, scene_.camera.distortion);
  EXPECT_EQ(reader.camera().width(), 64);
  ASSERT_EQ(reader.objects().size(), 2u);
  EXPECT_EQ(reader.objects()[0].name, "box");
  EXPECT_EQ(reader.objects()[0].symmetries.axis, Vector3d(0, 0, 1));
  ASSERT_TRUE(reader.objects()[1].initial_T_camera_object.has_value());
  for (int i = 0; i < 3; ++i) {
    const FrameAndTruth read = reader.read(i);
    const GroundTruth made = handMade(scene_, i);
    EXPECT_EQ(read.frame.index, i);
    EXPECT_EQ(read.frame.timestamp_ns, scene_.timestampNs(i + 1));
    EXPECT_EQ(read.frame.rgb(3, 3), (Rgb8{uint8_t(i + 1), 100, 200}));
    ASSERT_TRUE(read.truth.has_value());
    EXPECT_LT((read.truth->T_world_camera.matrix() - made.T_world_camera.matrix()).norm(), 1e-12);
    EXPECT_LT(
        (read.truth->objects[0].T_world_object.matrix() - made.objects[0].T_world_object.matrix())
            .norm(),
        1e-12);
    EXPECT_EQ(read.truth->objects[0].mask, made.objects[0].mask);
    EXPECT_EQ(read.truth->objects[0].px_visible, 45);
    EXPECT_NEAR(read.truth->depth_m(30, 30), 1.5, 1e-4);
  }
}

TEST_F(Bop, DataOfOthersHaveNeitherTimesNorWorld) {
  fs::remove(folder_ / "seq/bop/models/models_info.json");
  std::string cameras, poses;
  for (int id : {4, 7}) {
    const std::string comma = cameras.empty() ? "" : ", ";
    cameras += comma + "\"" + std::to_string(id) +
               "\": {\"cam_K\": [50, 0, 31, 0, 50, 23, 0, 0, 1], \"depth_scale\": 1.0}";
    poses += comma + "\"" + std::to_string(id) +
             "\": [{\"cam_R_m2c\": [1, 0, 0, 0, 1, 0, 0, 0, 1], \"cam_t_m2c\": [0, 0, " +
             std::to_string(500 + id) +
             "], \"obj_id\": 1}, "
             "{\"cam_R_m2c\": [1, 0, 0, 0, 1, 0, 0, 0, 1], \"cam_t_m2c\": [100, 0, 500], "
             "\"obj_id\": 1}]";
    fs::copy(bop_ / "rgb/000001.png", bop_ / ("rgb/00000" + std::to_string(id) + ".png"));
  }
  writeFileAtomically(bop_ / "scene_camera.json", "{" + cameras + "}");
  writeFileAtomically(bop_ / "scene_gt.json", "{" + poses + "}");
  fs::remove(bop_ / "scene_gt_info.json");
  BopReader reader(bop_);
  EXPECT_EQ(reader.timestampNs(1) - reader.timestampNs(0), 100'000'000);
  ASSERT_EQ(reader.objects().size(), 2u);
  EXPECT_EQ(reader.objects()[0].name, "obj_000001");
  EXPECT_EQ(reader.objects()[1].name, "obj_000001_2");
  const auto truth = reader.read(1).truth;
  EXPECT_NEAR(truth->T_world_camera.translation.z(), -0.507, 1e-12);
  EXPECT_NEAR(truth->objects[1].T_world_object.translation.x(), 0.1, 1e-12);
  EXPECT_FALSE(truth->objects[0].visibleFraction().has_value());
}

TEST_F(Bop, WhatIsWrongIsSaidWithItsPlace) {
  const fs::path camera = bop_ / "scene_camera.json", gt = bop_ / "scene_gt.json";
  const std::string good_camera = readFile(camera), good_gt = readFile(gt);
  const auto open = [&] { BopReader reader(bop_); };
  writeFileAtomically(camera, "{\n  \"1\": {,}\n}");
  EXPECT_THAT(errorLine(open, kExitBadData), HasSubstr("scene_camera.json:2:9: is no JSON"));
  writeFileAtomically(camera, "{\"1\": {\"cam_K\": [1, 2]}}");
  EXPECT_THAT(errorLine(open, kExitBadData), HasSubstr("`1.cam_K` must have 9 numbers, not 2"));
  writeFileAtomically(camera, std::string(100000, '['));
  EXPECT_THAT(errorLine(open, kExitBadData), HasSubstr("nests too deep"));
  writeFileAtomically(camera, good_camera);
  writeFileAtomically(gt,
                      "{\"1\": [{\"cam_R_m2c\": [2, 0, 0, 0, 1, 0, 0, 0, 1], "
                      "\"cam_t_m2c\": [0, 0, 1], \"obj_id\": 1}]}");
  EXPECT_THAT(errorLine(open, kExitBadData), HasSubstr("is no rotation"));
  writeFileAtomically(gt, good_gt);
  fs::remove(folder_ / "seq/bop/models/obj_000002.ply");
  errorLine(open, kExitMissingInput);
  createFolder(folder_ / "seq/bop/test/000001");
  fs::copy(camera, folder_ / "seq/bop/test/000001/scene_camera.json");
  EXPECT_THAT(errorLine([&] { findBopScene(folder_ / "seq"); }, kExitBadData),
              HasSubstr("has 2 scenes"));
}

TEST_F(Bop, MutatedFiles) {
  const std::vector<fs::path> files = {bop_ / "scene_camera.json", bop_ / "scene_gt.json",
                                       bop_ / "scene_gt_info.json",
                                       folder_ / "seq/bop/models/models_info.json"};
  std::vector<std::string> good;
  for (const fs::path& file : files) good.push_back(readFile(file));
  int accepted = 0;
  for (uint32_t seed = 0; seed < 600; ++seed) {
    const size_t which = seed % files.size();
    const std::string text = testing::Mutator(2000 + seed).mutate(good[which]);
    writeFileAtomically(files[which], text);
    accepted += testing::survives(
        [&] {
          const auto truth = BopReader(bop_, TruthImages::kNone).read(0).truth;
          if (truth) {
            EXPECT_TRUE(truth->T_world_camera.isFinite());
          }
        },
        text);
    writeFileAtomically(files[which], good[which]);
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 580);
}

TEST(LargestDistance, IsThatOfTheFarthestPair) {
  const Random random(5, RandomStream::kTest);
  std::vector<Vector3f> points;
  for (uint64_t i = 0; i < 300; ++i) {
    const auto n = random.normal(0, i);
    points.emplace_back(Vector3d(n[0], 2 * n[1], n[2]).cast<float>());
  }
  double expected = 0;
  for (const Vector3f& a : points)
    for (const Vector3f& b : points)
      expected = std::max(expected, (a.cast<double>() - b.cast<double>()).norm());
  EXPECT_DOUBLE_EQ(largestDistance(points), expected);
}

}  // namespace
}  // namespace diorama
