#include "app/run_input.h"

#include <cstdio>

#include "core/errors.h"
#include "core/files.h"
#include "core/measurements_io.h"
#include "core/sha256.h"
#include "sim/bop_reader.h"
#include "sim/euroc_reader.h"
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
    known.file = {object.mesh, object.scale, object.y_up};
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

// The mean rate of a reader's frames.
template <class Reader>
double meanRate(const Reader& reader) {
  const int n = reader.frameCount();
  if (n < 2) return 30;
  return (n - 1) / (1e-9 * static_cast<double>(reader.timestampNs(n - 1) - reader.timestampNs(0)));
}

// Meshes are often in millimetres, and nobody looks at a block as large as a house from near.
void warnOfMillimetres(const SequenceObject& object, const Mesh& mesh) {
  constexpr float kHouse_m = 10;
  const Vector3f size = mesh.maxCorner() - mesh.minCorner();
  if (object.scale == 1 && size.maxCoeff() > kHouse_m)
    std::fprintf(stderr,
                 "object `%s`: %s is %.3g x %.3g x %.3g m large; is `scale: 0.001` missing?\n",
                 object.name.c_str(), object.model.c_str(), size.x(), size.y(), size.z());
}

void addObjects(const std::vector<SequenceObject>& objects, RunInput& input) {
  for (const SequenceObject& object : objects) {
    ObjectModel model{object.name, importMesh(object.model, {object.scale, object.y_up}),
                      object.symmetries};
    warnOfMillimetres(object, model.mesh);
    input.objects.push_back({std::move(model),
                             {object.model, object.scale, object.y_up},
                             object.database,
                             object.initial_T_camera_object});
  }
}

template <class Reader>
void setSource(std::unique_ptr<Reader> reader, RunInput& input) {
  input.name = reader->name();
  input.rate_hz = meanRate(*reader);
  input.source = std::move(reader);
}

// Nobody here looks at pictures of the truth: they would take most of the time of reading.
// A sequence in any of the layouts that `render` writes. Objects from a file of their own take the
// place of the sequence's.
RunInput openSequence(const fs::path& folder, const std::optional<fs::path>& objects_file) {
  RunInput input;
  std::vector<SequenceObject> objects;
  std::string content;  // of the files that describe the input
  if (fs::exists(folder / "sequence.yaml")) {
    auto reader = std::make_unique<SequenceReader>(folder, TruthImages::kNone);
    content = readFile(folder / "sequence.yaml");
    if (reader->odometryFile())
      input.simulated_odometry = readMeasurements(*reader->odometryFile()).odometry;
    objects = reader->objects();
    setSource(std::move(reader), input);
  } else if (const auto scene = findBopScene(folder)) {
    auto reader = std::make_unique<BopReader>(*scene, TruthImages::kNone);
    content = readFile(*scene / "scene_camera.json");
    objects = reader->objects();
    setSource(std::move(reader), input);
  } else if (const auto mav0 = findEuroc(folder)) {
    content = readFile(*mav0 / "cam0/sensor.yaml") + readFile(*mav0 / "cam0/data.csv");
    setSource(std::make_unique<EurocReader>(*mav0), input);
    if (!objects_file)
      throw InputError(folder, "the EuRoC format has no objects to track",
                       "give them by --objects FILE.yaml, a list `objects:` as in sequence.yaml");
  } else {
    throw MissingInputError(folder / "sequence.yaml",
                            "expected a sequence folder, a BOP scene or a EuRoC mav0 folder");
  }
  if (objects_file) {
    objects = loadSequenceObjects(*objects_file);
    content += readFile(*objects_file);
  }
  addObjects(objects, input);
  input.digest = sha256(content);
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
                   const std::vector<YamlOverride>& overrides, const RenderOptions& render,
                   const std::optional<fs::path>& objects) {
  std::error_code error;
  if (!fs::exists(path, error))
    throw MissingInputError(path, "expected a scene file or a sequence folder");
  if (!fs::is_directory(path)) {
    if (objects) throw UsageError("--objects: a scene names its own objects");
    return openScene(path, first_frame, overrides, render);
  }
  if (!overrides.empty())
    throw UsageError("--set " + overrides.front().text +
                     ": a sequence has no scene options to set");
  return openSequence(path, objects);
}

}  // namespace diorama
