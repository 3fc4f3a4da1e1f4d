// Scenes and sequences that a few hundred random changes have damaged: an error of one line with
// the exit code 65 or 66, or a valid result; never a crash or a hang.
#include <gtest/gtest.h>

#include "mutator.h"
#include "sim/sequence_reader.h"
#include "small_scene.h"

namespace diorama {
namespace {

using testing::Mutator;
using testing::survives;

class Hostile : public testing::SmallScene {};

TEST_F(Hostile, MutatedScenes) {
  int accepted = 0;
  for (uint32_t seed = 0; seed < 600; ++seed) {
    const std::string text = Mutator(seed).mutate(yaml());
    accepted += survives(
        [&] {
          const Scene scene = parseScene(text, folder_ / "scene.yaml");
          EXPECT_TRUE(scene.T_world_camera(scene.frameCount() - 1).isFinite());
        },
        text);
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 500);
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
