// How often the tracker finds an object from a start that is off: for each frame of a sequence with
// truth, starts are drawn around the true pose. Prints one line a try, as CSV.
//
//   tracker_starts SEQ sigma_m sigma_deg tries (cold|warm) [options as of --set]...
//
// cold: a tracker that has seen nothing yet. warm: one that was told the true pose in the frame
// before, as after a push. Translations have the length sigma_m, rotations the angle sigma_deg, in
// random directions.
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>

#include "app/run_options.h"
#include "core/random.h"
#include "sim/embree_ray_query.h"
#include "sim/mesh_import.h"
#include "sim/sequence_reader.h"
#include "tracker/object_tracker.h"

namespace diorama {
namespace {

Vector3d directionOf(const std::array<double, 4>& normals) {
  return Vector3d(normals[0], normals[1], normals[2]).normalized();
}

struct Push {
  double m = 0, rad = 0;

  SE3 apply(const SE3& T, uint32_t frame, uint64_t index) const {
    const Random random(1, RandomStream::kTest);
    Vector6d xi;
    xi << m * directionOf(random.normal(frame, 2 * index)),
        rad * directionOf(random.normal(frame, 2 * index + 1));
    // Turned about the object's middle, moved in the camera's axes.
    return {(T.rotation * expSO3(xi.tail<3>())).normalized(), T.translation + xi.head<3>()};
  }
};

void measure(SequenceReader& sequence, const Push& push, int tries, bool warm,
             const TrackerOptions& options) {
  const SequenceObject& object = sequence.objects().front();
  const ObjectModel model{object.name, importMesh(object.model, {object.scale, object.y_up}),
                          object.symmetries};
  const auto rays = std::make_shared<const EmbreeRayQuery>(std::vector<Mesh>{model.mesh});
  std::printf("frame,claimed,health,err_m,err_rad\n");
  const int step = std::max(1, sequence.frameCount() / tries);
  for (int k = 1; k < sequence.frameCount(); k += step) {
    const auto truth = [&](int frame) {
      const GroundTruth found = *sequence.readTruth(frame);
      return found.T_world_camera.inverse() * found.objects.front().T_world_object;
    };
    const SE3 T = truth(k);
    EdgeTracker tracker(model, sequence.camera(), rays, 0, options);
    if (warm) tracker.track(sequence.read(k - 1).frame, ObjectPrediction{truth(k - 1)});
    const ObjectMeasurement m = tracker.track(
        sequence.read(k).frame, ObjectPrediction{push.apply(T, static_cast<uint32_t>(k), 0)});
    std::printf("%d,%d,%.4f,%.6f,%.6f\n", k, m.claimed, m.health,
                (m.T_camera_object.translation - T.translation).norm(),
                angleBetween(m.T_camera_object.rotation, T.rotation));
  }
}

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: tracker_starts SEQ m deg tries cold|warm [path=value]...\n");
    return 2;
  }
  const Push push{std::atof(argv[2]), std::atof(argv[3]) * std::numbers::pi / 180};
  const std::vector<std::string> sets(argv + 6, argv + argc);
  const RunOptions options = readRunOptions({}, splitOverrides(sets).estimators);
  SequenceReader sequence(argv[1], TruthImages::kNone);
  measure(sequence, push, std::atoi(argv[4]), std::string(argv[5]) == "warm", options.tracker);
  return 0;
}

}  // namespace
}  // namespace diorama

int main(int argc, char** argv) { return diorama::main(argc, argv); }
