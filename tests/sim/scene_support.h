// Small scenes for tests, with meshes written to a folder of their own.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/files.h"
#include "sim/scene.h"

namespace diorama::test {

// A folder that is removed again, and a cache folder in it that stands in for the user's.
class Workshop {
 public:
  explicit Workshop(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() /
                ("diorama_" + name + "_" + std::to_string(::getpid()))) {
    createFolder(folder_);
    ::setenv("DIORAMA_CACHE", cache().c_str(), 1);
  }
  ~Workshop() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::filesystem::path cache() const { return folder_ / "cache"; }
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    writeFileAtomically(folder_ / name, content);
    return folder_ / name;
  }
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

class FixedPath : public MotionPath {
 public:
  explicit FixedPath(const SE3& pose) : pose_(pose) {}
  SE3 pose(double) const override { return pose_; }

 private:
  SE3 pose_;
};

// A camera at the origin that looks along +x of the world, z upwards in the image; no noise, no
// vignette, no blur.
inline Scene plainScene() {
  Scene scene;
  scene.name = "test";
  scene.camera = {CameraModel::kPinhole, 160, 120, 130, 130, 79.5, 59.5, {}};
  scene.path = std::make_shared<FixedPath>(lookAt(Vector3d::Zero(), Vector3d(1, 0, 0)));
  scene.duration_s = 1;
  scene.effects.noise = false;
  scene.effects.blur = false;
  scene.effects.vignette = 0;
  return scene;
}

inline SceneObject object(const std::string& name, const std::filesystem::path& mesh,
                          const Vector3d& position, bool tracked = true) {
  SceneObject result;
  result.name = name;
  result.mesh = mesh;
  result.T_world_object.translation = position;
  result.tracked = tracked;
  return result;
}

// A square of the given side in the plane x = 0, facing -x (towards the camera), with texture
// coordinates 0..1: u to the camera's right (-y), v upwards (+z).
inline std::string square(double side, const std::string& header = "") {
  const std::string h = std::to_string(side / 2);
  return header + "v 0 " + h + " -" + h + "\nv 0 -" + h + " -" + h + "\nv 0 -" + h + " " + h +
         "\nv 0 " + h + " " + h +
         "\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn -1 0 0\nusemtl paint\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";
}

}  // namespace diorama::test
