#include "app/run_input.h"

#include "core/errors.h"
#include "core/files.h"
#include "core/measurements_io.h"
#include "core/sha256.h"
#include "sim/mesh_import.h"
#include "sim/scene.h"
#include "sim/sequence_reader.h"
#include "sim/simulated_odometry.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

std::vector<OdometryMeasurement> simulateOdometry(const Scene& scene) {
  const SimulatedOdometry sensor(trueCameraPath(scene), scene.odometry, scene.seed);
  std::vector<OdometryMeasurement> steps;
  for (int frame = 1; frame < scene.frameCount(); ++frame)
    steps.push_back(sensor.measure(static_cast<size_t>(frame - 1), static_cast<size_t>(frame)));
  return steps;
}

RunInput openScene(const fs::path& file, int first_frame,
                   const std::vector<YamlOverride>& overrides, const RenderOptions& render) {
  const Scene scene = loadScene(file, overrides);
  RunInput input;
  input.name = scene.name;
  input.seed = scene.seed;
  input.rate_hz = scene.rate_hz;
  input.digest = sha256(describeScene(scene));
  input.initial_frame = first_frame;
  input.simulated_odometry = simulateOdometry(scene);
  for (const SceneObject& object : scene.objects) {
    if (!object.tracked) continue;
    KnownObject known;
    known.model = {object.name, importMesh(object.mesh, {object.scale, object.y_up}),
                   object.symmetries};
    if (first_frame < scene.frameCount())
      known.initial_T_camera_object =
          scene.T_world_camera(first_frame).inverse() * object.pose(scene.time_s(first_frame));
    input.objects.push_back(std::move(known));
  }
  input.source = std::make_unique<Simulator>(scene, render);
  return input;
}

double meanRate(const SequenceReader& reader) {
  const int n = reader.frameCount();
  if (n < 2) return 30;
  return (n - 1) / (1e-9 * static_cast<double>(reader.timestampNs(n - 1) - reader.timestampNs(0)));
}

RunInput openSequence(const fs::path& folder) {
  auto reader = std::make_unique<SequenceReader>(folder);
  RunInput input;
  input.name = reader->name();
  input.rate_hz = meanRate(*reader);
  input.digest = sha256(readFile(folder / "sequence.yaml"));
  if (reader->odometryFile())
    input.simulated_odometry = readMeasurements(*reader->odometryFile()).odometry;
  for (const SequenceObject& object : reader->objects()) {
    ObjectModel model{object.name, importMesh(object.model, {object.scale, object.y_up}),
                      object.symmetries};
    input.objects.push_back({std::move(model), object.initial_T_camera_object});
  }
  input.source = std::move(reader);
  return input;
}

}  // namespace

RenderQuality parseQuality(const std::string& name) {
  if (name == "draft") return RenderQuality::kDraft;
  if (name == "standard") return RenderQuality::kStandard;
  if (name == "high") return RenderQuality::kHigh;
  throw UsageError("--quality " + name + ": possible: draft, standard, high");
}

RunInput openInput(const fs::path& path, int first_frame,
                   const std::vector<YamlOverride>& overrides, const RenderOptions& render) {
  std::error_code error;
  if (!fs::exists(path, error))
    throw MissingInputError(path, "expected a scene file or a sequence folder");
  if (!fs::is_directory(path)) return openScene(path, first_frame, overrides, render);
  if (!overrides.empty())
    throw UsageError("--set " + overrides.front().text +
                     ": a sequence has no scene options to set");
  return openSequence(path);
}

}  // namespace diorama
