// A sequence that is rendered once, whose copy each test spoils.
#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>

#include "core/text.h"
#include "core/trajectory.h"
#include "sim/image_file.h"
#include "sim/png_encoder.h"
#include "sim/sequence_check.h"
#include "sim/sequence_writer.h"
#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama::test {

// A box around a point; `inside` turns the faces, for a room. Several make one mesh.
inline std::string box(double x, double y, double z, bool inside = false,
                       const Vector3d& center = Vector3d::Zero()) {
  std::string text;
  for (int i = 0; i < 8; ++i)
    text += "v " + formatNumber(center.x() + (i & 1 ? x : -x) / 2) + " " +
            formatNumber(center.y() + (i & 2 ? y : -y) / 2) + " " +
            formatNumber(center.z() + (i & 4 ? z : -z) / 2) + "\n";
  for (const auto& f : {"1342", "5687", "1265", "3784", "1573", "2486"}) {
    std::string corners(f);
    if (inside) std::reverse(corners.begin(), corners.end());
    text += "f";
    for (char c : corners) text += " -" + std::to_string('9' - c);  // of the last eight
    text += "\n";
  }
  return text;
}

// A camera that passes a known box, half hidden behind an unknown one, in a room.
inline Scene checkedScene(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.camera = {CameraModel::kRadTan, 160, 120, 130, 131, 80, 59, {-0.1, 0.02, 0.001, 0}};
  scene.path = makeSplinePath({{0, lookAt(Vector3d(-0.8, -0.3, 0.4), Vector3d(0, 0, 0))},
                               {0.2, lookAt(Vector3d(-0.75, -0.2, 0.35), Vector3d(0, 0.05, 0))},
                               {0.4, lookAt(Vector3d(-0.8, -0.1, 0.3), Vector3d(0.05, 0, 0))}});
  scene.rate_hz = 20;
  scene.duration_s = 0.4;
  scene.ambient = 0.5;
  scene.objects = {
      object("known", workshop.write("known.obj", box(0.2, 0.25, 0.3)), Vector3d(0, 0, 0)),
      object("other", workshop.write("other.obj", box(0.1, 0.1, 0.2)), Vector3d(-0.2, 0.05, -0.05),
             false),
      object("room", workshop.write("room.obj", box(4, 3, 2, true)), Vector3d(0.5, 0, 0.85),
             false)};
  scene.objects[0].T_world_object.rotation = expSO3({0, 0, 0.4});
  return scene;
}

// Rendered once; each test spoils a copy.
class CheckedSequence : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    workshop_ = new Workshop("check");
    film(checkedScene(*workshop_), workshop_->folder() / "good");
  }
  static void film(const Scene& scene, const std::filesystem::path& folder) {
    Simulator simulator(scene, {RenderQuality::kDraft, 1, {.normal = true, .flow = true}});
    SequenceWriter writer(folder, scene);
    for (int k = 0; k < simulator.frameCount(); ++k) {
      const FrameAndTruth frame = simulator.read(k);
      writer.write(frame.frame, *frame.truth);
    }
    writer.finish();
  }
  static void TearDownTestSuite() { delete workshop_; }

  void SetUp() override {
    sequence_ = workshop_->folder() / "copy";
    std::filesystem::remove_all(sequence_);
    std::filesystem::copy(workshop_->folder() / "good", sequence_,
                          std::filesystem::copy_options::recursive);
  }

  std::vector<CheckFinding> findings() const {
    const SequenceCheck check(sequence_);
    CheckResult all = check.checkWhole();
    for (int part = 0; part < check.partCount(); ++part) all.append(check.checkPart(part));
    return all.findings;
  }
  std::vector<CheckFinding> findingsWithoutManifest() const {
    std::filesystem::remove(sequence_ / "manifest.csv");
    return findings();
  }

  std::string text(const std::string& file) const { return readFile(sequence_ / file); }
  void rewrite(const std::string& file, const std::string& content) const {
    writeFileAtomically(sequence_ / file, content);
  }
  void replace(const std::string& file, const std::string& from, const std::string& to) const {
    std::string content = text(file);
    const size_t at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    rewrite(file, content.replace(at, from.size(), to));
  }

  template <class T>
  Image<T> image(const std::string& file) const {
    return std::get<Image<T>>(readImage(sequence_ / file, 160, 120));
  }
  void changeDepth(const std::string& file, int x, int y, int units) const {
    Image<uint16_t> depth = image<uint16_t>(file);
    depth(x, y) = static_cast<uint16_t>(depth(x, y) + units);
    rewrite(file, encodePng(depth));
  }
  // T * Exp(xi) in one line of a trajectory.
  void movePose(const std::string& file, size_t line, const Vector6d& xi) const {
    Trajectory path = readTum(sequence_ / file);
    path.poses[line].pose = path.poses[line].pose * exp(xi);
    rewrite(file, toTum(path));
  }

  inline static Workshop* workshop_ = nullptr;
  std::filesystem::path sequence_;
};

inline std::string listed(const std::vector<CheckFinding>& findings) {
  std::string all;
  for (const CheckFinding& f : findings) all += f.file + ": " + f.what + "\n";
  return all;
}

}  // namespace diorama::test
