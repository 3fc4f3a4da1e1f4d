// Scenes and sequences that a few hundred random changes have damaged: an error of one line with
// the exit code 65 or 66, or a valid result; never a crash or a hang.
#include <gtest/gtest.h>

#include <chrono>

#include "core/random.h"
#include "sim/sequence_reader.h"
#include "small_scene.h"

namespace diorama {
namespace {

class Mutator {
 public:
  explicit Mutator(uint32_t seed) : random_(99, RandomStream::kTest), seed_(seed) {}

  std::string mutate(std::string text) {
    const uint32_t changes = 1 + draw(3);
    for (uint32_t i = 0; i < changes && !text.empty(); ++i) change(text);
    return text;
  }

 private:
  uint32_t draw(size_t n) { return random_.bits(seed_, counter_++)[0] % static_cast<uint32_t>(n); }

  void change(std::string& text) {
    static const std::vector<std::string> tokens = {
        "nan",    ".inf",     "-1",         "0",    "1e308", "1e-308", "999999999999999999999",
        "[",      "]",        "{",          "}",    ":",     ",",      "- ",
        "\n",     "  ",       "*a",         "&a",   "!!",    "~",      "''",
        "\"",     "#",        "%",          "../",  "\t",    "true",   "[]",
        "{}",     "|",        "???",        "\xff", "é",     "- - -",  ">",
        "<<: *a", "position", "2147483648", "0.25", "1",     "2",      "0.125",
        "3.5",    "33"};
    const size_t at = draw(text.size()), length = std::min<size_t>(draw(12), text.size() - at);
    switch (draw(5)) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text[at] = static_cast<char>(draw(256));
        break;
      case 2:
        text.insert(at, text.substr(draw(text.size()), length));
        break;
      case 3: {  // a number becomes something else
        const size_t digit = text.find_first_of("0123456789", at);
        if (digit == std::string::npos) return;
        const size_t end = text.find_first_not_of("0123456789.e", digit);
        text.replace(digit, end - digit, tokens[draw(tokens.size())]);
        break;
      }
      default:
        text.insert(at, tokens[draw(tokens.size())]);
    }
  }

  Random random_;
  uint32_t seed_;
  uint64_t counter_ = 0;
};

// What a damaged file did: threw one good line, or was accepted.
template <class Action>
bool survives(const Action& action, const std::string& text) {
  const auto start = std::chrono::steady_clock::now();
  bool accepted = false;
  try {
    action();
    accepted = true;
  } catch (const Error& error) {
    EXPECT_TRUE(error.code() == kExitBadData || error.code() == kExitMissingInput) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what() << "\n" << text;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20)) << text;
  return accepted;
}

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
