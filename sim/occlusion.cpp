#include "sim/occlusion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/files.h"
#include "core/sha256.h"
#include "core/text.h"
#include "sim/mesh_import.h"
#include "sim/model_files.h"
#include "sim/occlusion_solver.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr int kVersion = 1;  // of the solver and the file; a change makes old files unknown

Mesh meshOf(const SceneObject& object) {
  return importMesh(object.mesh, {object.scale, object.y_up});
}

// Everything that a way depends on.
std::string keyOf(const OcclusionRequest& request, const SceneObject& occluder,
                  const Scene& scene) {
  std::string text = "occlusion " + std::to_string(kVersion) + "\n" + describeStage(scene);
  text += modelChecksum(occluder.mesh) + " of " + std::to_string(request.object);
  for (const VisibleFraction& f : request.visible_fraction)
    text += " " + formatNumber(f.time_s) + ":" + formatNumber(f.fraction);
  if (request.side) text += " side " + std::to_string(*request.side);
  if (request.distance_m) text += " at " + formatNumber(*request.distance_m);
  Sha256 hash;
  hash.update(text);
  return hash.hexDigest();
}

std::string toText(const OccluderTrack& track) {
  std::string text = formatNumber(track.lane.distance_m) + " " + formatNumber(track.lane.side_rad) +
                     " " + std::to_string(track.first);
  for (double slide_m : track.slide_m) text += " " + formatNumber(slide_m);
  return text + " end\n";
}

// Nothing when the file is not there or not whole.
std::optional<OccluderTrack> readTrack(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  const std::string content = readFile(file);
  const std::vector<std::string_view> words = splitBlanks(trim(content));
  if (words.size() < 5 || words.back() != "end") return std::nullopt;
  std::vector<double> numbers;
  for (size_t i = 0; i + 1 < words.size(); ++i) {
    const std::optional<double> number = parseNumber(words[i]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers.push_back(*number);
  }
  return OccluderTrack{
      {numbers[0], numbers[1]}, static_cast<int>(numbers[2]), {numbers.begin() + 3, numbers.end()}};
}

// The meshes of a scene, imported when a way must be solved for.
class StageMeshes {
 public:
  void prepare(const Scene& scene) {
    while (objects_.size() < scene.objects.size())
      objects_.push_back(meshOf(scene.objects[objects_.size()]));
    if (!environment_ && !scene.environment_mesh.empty())
      environment_ = importMesh(scene.environment_mesh);
  }
  const std::vector<Mesh>& objects() const { return objects_; }
  const Mesh* environment() const { return environment_ ? &*environment_ : nullptr; }

 private:
  std::vector<Mesh> objects_;
  std::optional<Mesh> environment_;
};

OccluderTrack solve(const OcclusionRequest& request, const OccluderKind& kind,
                    const SceneObject& occluder, const Scene& scene, StageMeshes& meshes) {
  meshes.prepare(scene);
  const ObjectViewer viewer(scene, request.object, meshes.objects(), meshes.environment());
  WorkerPool pool(0);
  const OcclusionSolution solution =
      solveOcclusion(request, kind, meshOf(occluder), scene, viewer, pool);
  if (!solution.problem.empty())
    throw InputError(request.place,
                     "`" + request.name + "` cannot hide `" + scene.objects[request.object].name +
                         "` as asked: " + solution.problem,
                     "ask for other times or fractions, or another occluder");
  return solution.track;
}

}  // namespace

double requestedFraction(const OcclusionRequest& request, double time_s) {
  const std::vector<VisibleFraction>& knots = request.visible_fraction;
  if (time_s <= knots.front().time_s) return knots.front().fraction;
  for (size_t k = 1; k < knots.size(); ++k) {
    if (time_s > knots[k].time_s) continue;
    const double share = (time_s - knots[k - 1].time_s) / (knots[k].time_s - knots[k - 1].time_s);
    return knots[k - 1].fraction + share * (knots[k].fraction - knots[k - 1].fraction);
  }
  return knots.back().fraction;
}

const std::vector<OccluderKind>& occluderKinds() {
  constexpr double kPi = std::numbers::pi;
  constexpr double kArm = 0.35;  // a forearm comes from below the hand
  static const std::vector<OccluderKind> kinds = {
      {"hand", "occluder_hand", {0, 0, 0.33}, {-kArm, kPi + kArm, -kPi / 2, kPi / 2}, true, false},
      {"board", "occluder_board", {0, 0, 0.16}, {0, kPi, -kPi / 2, kPi / 2}, false, false},
      {"pole", "occluder_pole", {0, 0, 0.25}, {0, kPi}, false, true},
      {"box", "occluder_box", {0, 0, 0.09}, {0, kPi}, false, true},
  };
  return kinds;
}

std::vector<std::string> sideNames(const OccluderKind& kind) {
  std::vector<std::string> names = {"right", "left", "below", "above"};
  names.resize(kind.sides_rad.size());
  return names;
}

void addOccluders(const std::vector<OcclusionRequest>& requests, Scene& scene) {
  StageMeshes meshes;
  for (const OcclusionRequest& request : requests) {
    const auto& kinds = occluderKinds();
    const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                   [&](const OccluderKind& k) { return k.name == request.model; });
    DIORAMA_CHECK(kind != kinds.end() && request.object < scene.objects.size() &&
                  !request.visible_fraction.empty());
    SceneObject occluder;
    occluder.name = request.name;
    occluder.model = kind->model;
    occluder.mesh = dataFolder() / "models" / kind->model / (kind->model + ".obj");
    const fs::path file = cacheFolder() / "occlusion" / (keyOf(request, occluder, scene) + ".txt");
    std::optional<OccluderTrack> track = readTrack(file);
    if (!track) {
      track = solve(request, *kind, occluder, scene, meshes);
      createFolder(file.parent_path());
      writeFileAtomically(file, toText(*track));
    }
    const SceneObject& object = scene.objects[request.object];
    const Mesh mesh = meshOf(object);
    const Vector3d middle = (mesh.minCorner() + mesh.maxCorner()).cast<double>() / 2;
    occluder.path = makeOccluderPath(*kind, *track, scene, object, middle);
    occluder.T_world_object = occluder.path->pose(0);
    scene.objects.push_back(std::move(occluder));
  }
}

}  // namespace diorama
