#include "app/object_training.h"

#include <algorithm>
#include <cmath>

#include "app/command_line.h"
#include "app/progress.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"
#include "sim/embree_ray_query.h"
#include "sim/model_files.h"
#include "sim/simulator.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// One view a frame, and nothing in between.
class ViewPath : public MotionPath {
 public:
  ViewPath(const std::vector<SE3>& views, double rate_hz) : rate_hz_(rate_hz) {
    for (const SE3& T_camera_object : views) poses_.push_back(T_camera_object.inverse());
  }
  SE3 pose(double time_s) const override {
    const double last = static_cast<double>(poses_.size() - 1);
    return poses_[static_cast<size_t>(std::clamp(std::round(time_s * rate_hz_), 0.0, last))];
  }

 private:
  std::vector<SE3> poses_;
  double rate_hz_;
};

// The world is the object's frame. Light comes evenly from all sides, so that no shadow is learned.
Scene studio(const ModelFile& file, const std::vector<SE3>& views) {
  Scene scene;
  scene.name = "training";
  scene.camera = trainingCamera().parameters();
  scene.exposure_s = 0.001;  // shorter than half of a frame's time: each picture is one view
  scene.path = std::make_shared<ViewPath>(views, scene.rate_hz);
  scene.duration_s = static_cast<double>(views.size()) / scene.rate_hz;
  SceneObject object;
  object.name = "object";
  object.mesh = file.mesh;
  object.scale = file.scale;
  object.y_up = file.y_up;
  object.tracked = true;
  scene.objects.push_back(object);
  scene.ambient = 1;
  scene.effects.blur = scene.effects.noise = false;
  scene.effects.vignette = 0;
  return scene;
}

}  // namespace

ObjectDatabase trainFrom(const ModelFile& file, const ObjectModel& model,
                         const TrainingOptions& options) {
  const EmbreeRayQuery rays({&model.mesh, 1});
  Simulator simulator(studio(file, trainingViews(model.mesh, options)));
  Progress progress("training " + model.name, simulator.frameCount());
  const auto picture = [&](int index) {
    throwIfInterrupted();
    progress.update(index + 1);
    return simulator.read(index).frame;
  };
  return trainDatabase(model, rays, 0, picture, options);
}

ObjectDatabase trainOrRemember(const ModelFile& file, const ObjectModel& model,
                               const TrainingOptions& options) {
  YAML::Emitter text;
  text << YAML::BeginMap;
  writeOptions(text, "training", options);
  text << YAML::EndMap;
  const std::string key =
      sha256(std::string(DIORAMA_VERSION) + model.name + modelChecksum(file.mesh) +
             meshChecksum(model.mesh) + text.c_str());
  const fs::path cached = cacheFolder() / "databases" / (key + ".db");
  std::error_code error;
  if (fs::exists(cached, error)) try {
      return readDatabase(cached);
    } catch (const InputError&) {  // of an older version, or damaged: made anew
    }
  ObjectDatabase database = trainFrom(file, model, options);
  try {
    createFolder(cached.parent_path());
    writeDatabase(database, cached);
  } catch (const OutputError&) {  // a cache that cannot be written is no error
  }
  return database;
}

}  // namespace diorama
