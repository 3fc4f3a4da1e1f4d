// What a run works on: a scene that is filmed on the fly, or a sequence from disk. Both look alike
// from here on.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/object_training.h"
#include "core/frame_source.h"
#include "core/measurements.h"
#include "core/object_model.h"
#include "core/yaml.h"
#include "sim/simulator.h"

namespace diorama {

// draft, standard or high; throws UsageError.
RenderQuality parseQuality(const std::string& name);

struct KnownObject {
  ObjectModel model;
  ModelFile file;                                 // that it was imported from
  std::optional<std::filesystem::path> database;  // for its detection, as the sequence names it
  std::optional<SE3> initial_T_camera_object;     // in frame `initial_frame` of the input
};

struct RunInput {
  std::string name;  // of the scene or sequence
  uint64_t seed = 0;
  double rate_hz = 30;
  std::string digest;  // changes when the input changes
  std::unique_ptr<FrameSource> source;
  std::vector<KnownObject> objects;
  int initial_frame = 0;
  // What the simulated odometry sensor measured; nothing when there is no such sensor.
  std::optional<std::vector<OdometryMeasurement>> simulated_odometry;
};

// A scene (a file) or a sequence (a folder with sequence.yaml, a BOP scene, or EuRoC's mav0).
// `first_frame` is where the run begins. Overrides change the scene; a sequence takes none, but its
// objects may come from a file of their own (loadSequenceObjects). Throws InputError,
// MissingInputError or UsageError.
RunInput openInput(const std::filesystem::path& path, int first_frame,
                   const std::vector<YamlOverride>& overrides, const RenderOptions& render,
                   const std::optional<std::filesystem::path>& objects = {});

}  // namespace diorama
