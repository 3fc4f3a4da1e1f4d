// Scenes, sequences and meshes that a few hundred random changes have damaged: an error of one line
// with the exit code 65 or 66, or a valid result; never a crash or a hang.
#include <gtest/gtest.h>

#include "core/files.h"
#include "mutator.h"
#include "sim/mesh_import.h"
#include "sim/sequence_reader.h"
#include "small_scene.h"

namespace diorama {
namespace {

using testing::mutationCount;
using testing::Mutator;
using testing::survives;

class Hostile : public testing::SmallScene {};

TEST_F(Hostile, MutatedScenes) {
  const uint32_t count = mutationCount(600);
  uint32_t accepted = 0;
  for (uint32_t seed = 0; seed < count; ++seed) {
    const std::string text = Mutator(seed).mutate(yaml());
    accepted += survives(
        [&] {
          const Scene scene = parseScene(text, folder_ / "scene.yaml");
          EXPECT_TRUE(scene.T_world_camera(scene.frameCount() - 1).isFinite());
        },
        text);
  }
  EXPECT_GT(accepted, count / 30);
  EXPECT_LT(accepted, count * 5 / 6);
}

// Meshes of every format that the importer is likely to meet, and the material file of one.
TEST_F(Hostile, MutatedMeshes) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n3 0 1 2\n3 0 1 3\n";
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0.1 0\nendloop\n"
      "endfacet\n";
  std::string binary(80, ' ');  // STL: header, count, then 12 floats and 2 bytes for a triangle
  binary += std::string("\1\0\0\0", 4) + std::string(12, '\0');
  for (const float v : {0.f, 0.f, 0.f, 0.1f, 0.f, 0.f, 0.f, 0.1f, 0.f})
    binary.append(reinterpret_cast<const char*>(&v), sizeof v);
  binary += std::string(2, '\0');
  const std::vector<std::pair<std::string, std::string>> files = {
      {"a.obj", readFile(folder_ / "box.obj")},
      {"box.mtl", readFile(folder_ / "box.mtl")},
      {"a.ply", ply},
      {"a.stl", "solid a\n" + facet + "endsolid a\n"},
      {"b.stl", binary},
      {"a.off", "OFF\n4 2 0\n0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n3 0 1 2\n3 0 1 3\n"}};
  const uint32_t count = mutationCount(300);
  uint32_t accepted = 0;
  for (uint32_t seed = 0; seed < count; ++seed) {
    const auto& [name, good] = files[seed % files.size()];
    const std::string text = Mutator(20000 + seed).mutate(good);
    writeFileAtomically(folder_ / name, text);
    const std::string mesh = name == "box.mtl" ? "a.obj" : name;
    accepted +=
        survives([&] { EXPECT_GT(importMesh(folder_ / mesh).triangles.size(), 0) << text; }, text);
    writeFileAtomically(folder_ / name, good);
  }
  EXPECT_GT(accepted, count / 10);
  EXPECT_LT(accepted, count);
}

TEST_F(Hostile, MutatedSequences) {
  const std::string description =
      "camera: {model: pinhole, width: 64, height: 48, fx: 50, fy: 50, cx: 31.5, cy: 23.5}\n"
      "images: rgb.txt\nobjects:\n  - name: box\n    model: box.obj\n    scale: 1.0\n"
      "    initial_T_camera_object: {position: [0, 0, 1], quaternion_xyzw: [0, 0, 0, 1]}\n"
      "    symmetries: [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]]\n";
  const std::string list = "# a\n# b\n# c\n0.000000 rgb/000000.png\n0.033333 rgb/000001.png\n";
  const std::string poses = "# a\n0.000000 1 2 3 0 0 0 1\n0.033333 1 2 3 0 0 0 1\n";
  const std::string visibility =
      "frame,object,px_all,px_valid,px_visible,visible_fraction\n"
      "0,box,10,9,8,0.8\n";
  const std::vector<std::pair<std::string, std::string>> files = {{"sequence.yaml", description},
                                                                  {"rgb.txt", list},
                                                                  {"groundtruth.txt", poses},
                                                                  {"visibility.csv", visibility},
                                                                  {"depth.txt", list}};
  int accepted = 0;
  for (uint32_t seed = 0; seed < 500; ++seed) {
    for (const auto& [name, content] : files) writeFileAtomically(folder_ / name, content);
    const auto& [name, content] = files[seed % files.size()];
    const std::string text = Mutator(1000 + seed).mutate(content);
    writeFileAtomically(folder_ / name, text);
    accepted += survives([&] { SequenceReader reader(folder_); }, text);
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 480);
}

}  // namespace
}  // namespace diorama
