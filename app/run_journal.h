// What the report shows beside a run's results: the truth that was known, the error of each frame,
// the time of each stage, and the shapes of the objects.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/pipeline_types.h"
#include "core/ground_truth.h"
#include "core/object_model.h"

namespace diorama {

class RunJournal {
 public:
  explicit RunJournal(std::vector<ObjectModel> models);

  // One processed frame; `number` is its number in the scene or sequence.
  void add(int number, int64_t timestamp_ns, const FrameResult& result,
           const std::optional<GroundTruth>& truth);

  // truth/camera.txt (T_world_camera), truth/objects/NAME.txt (T_camera_object; both only where
  // they are known), errors.csv (of what is reported, one row per frame and object), timing.csv
  // (one row per frame) and models.json (coarse meshes). Throws OutputError.
  void write(const std::filesystem::path& folder) const;

 private:
  std::string modelsJson() const;

  std::vector<ObjectModel> models_;
  Trajectory camera_;
  std::vector<Trajectory> objects_;
  std::string errors_, timing_;
};

}  // namespace diorama
