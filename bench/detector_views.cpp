// What the detector finds in each frame of a sequence with truth, each frame as if nothing were
// known. Prints one line a frame and object, as CSV.
//
//   detector_views SEQ [--every N] [--absent MODEL]... [options as of --set]...
//
// MODEL is a mesh that is looked for although the sequence does not name it. Errors are those of
// what was found; true_* is what the verification says about the true pose, and cpu_ms is the time
// of all objects together.
#include <cstdio>
#include <ctime>
#include <limits>
#include <numeric>
#include <opencv2/core/utility.hpp>
#include <string>

#include "app/object_training.h"
#include "app/run_options.h"
#include "sim/embree_ray_query.h"
#include "sim/mesh_import.h"
#include "sim/sequence_reader.h"
#include "tracker/database_detector.h"
#include "tracker/object_tracker.h"

namespace diorama {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double cpuMilliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Wanted {
  std::vector<DetectorObject> objects;
  std::vector<Mesh> meshes;
  size_t present = 0;  // the first ones are in the sequence
  size_t size() const { return objects.size(); }
  void add(const std::string& name, const ModelFile& file, const Symmetries& symmetries,
           const TrainingOptions& training) {
    const ObjectModel model{name, importMesh(file.mesh, {file.scale, file.y_up}), symmetries};
    meshes.push_back(model.mesh);
    objects.push_back({model, trainOrRemember(file, model, training)});
  }
};

// What the verification makes of a pose.
class Examiner {
 public:
  Examiner(const DetectorObject& object, int index, const Camera& camera,
           std::shared_ptr<const RayQuery> rays, const TrackerOptions& options)
      : camera_(camera),
        looks_(object.database.looks),
        centre_(0.5 *
                (object.model.mesh.minCorner() + object.model.mesh.maxCorner()).cast<double>()),
        tracker_(object.model, camera, std::move(rays), index, options) {}

  Detection operator()(const Frame& frame, const SE3& start) {
    const ObjectMeasurement m = tracker_.examine(frame, {start});
    return {m.T_camera_object, m.health,
            compareLooks(looks_, MeanImage(frame), camera_, m.T_camera_object, centre_), 0};
  }

 private:
  const Camera& camera_;
  const std::vector<DatabaseLook> looks_;
  const Vector3d centre_;
  EdgeTracker tracker_;
};

struct Error {
  double m = kUnknown, rad = kUnknown;
  Error() = default;
  Error(const SE3& a, const SE3& b)
      : m((a.translation - b.translation).norm()), rad(angleBetween(a.rotation, b.rotation)) {}
};

void print(int frame, const std::string& name, const std::optional<Detection>& found,
           const std::optional<double>& visible, const std::optional<SE3>& truth,
           const std::optional<Detection>& at_truth, double milliseconds) {
  const Detection none{SE3{}, kUnknown, kUnknown, 0};
  const Detection &d = found.value_or(none), &t = at_truth.value_or(none);
  const Error error = found && truth ? Error(d.T_camera_object, *truth) : Error();
  const Error moved = at_truth ? Error(t.T_camera_object, *truth) : Error();
  std::printf("%d,%s,%d,%.4f,%d,%.4f,%.4f,%d,%.6f,%.6f,%.4f,%.4f,%.6f,%.6f,%.1f\n", frame,
              name.c_str(), truth.has_value(), visible.value_or(kUnknown), found.has_value(),
              d.health, d.look.value_or(kUnknown), d.inliers, error.m, error.rad, t.health,
              t.look.value_or(kUnknown), moved.m, moved.rad, milliseconds);
}

void measure(SequenceReader& sequence, int every, Wanted wanted, const RunOptions& options) {
  const auto rays = std::make_shared<const EmbreeRayQuery>(wanted.meshes);
  std::vector<std::unique_ptr<Examiner>> examiners;
  for (size_t i = 0; i < wanted.present; ++i)
    examiners.push_back(std::make_unique<Examiner>(wanted.objects[i], static_cast<int>(i),
                                                   sequence.camera(), rays, options.tracker));
  std::vector<std::string> names;
  for (const DetectorObject& object : wanted.objects) names.push_back(object.model.name);
  std::vector<int> all(wanted.size());
  std::iota(all.begin(), all.end(), 0);
  DatabaseDetector detector(std::move(wanted.objects), sequence.camera(), rays, options.detector,
                            options.tracker);
  std::printf(
      "frame,object,present,visible_fraction,found,health,look,inliers,err_m,err_rad,"
      "true_health,true_look,true_moved_m,true_moved_rad,cpu_ms\n");
  for (int k = 0; k < sequence.frameCount(); k += every) {
    const FrameAndTruth frame = sequence.read(k);
    const double start = cpuMilliseconds();
    const auto found = detector.detect(frame.frame, all);
    const double milliseconds = cpuMilliseconds() - start;
    for (size_t i = 0; i < all.size(); ++i) {
      std::optional<SE3> truth;
      std::optional<double> visible;
      std::optional<Detection> at_truth;
      if (i < wanted.present) {
        const ObjectTruth& object = frame.truth->objects.at(i);
        truth = frame.truth->T_world_camera.inverse() * object.T_world_object;
        visible = object.visibleFraction();
        at_truth = (*examiners[i])(frame.frame, *truth);
      }
      print(k, names[i], found[i], visible, truth, at_truth, milliseconds);
    }
  }
}

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr,
                 "usage: detector_views SEQ [--every N] [--absent MODEL]... [path=value]...\n");
    return 2;
  }
  std::vector<std::filesystem::path> absent;
  std::vector<std::string> sets;
  int every = 1;
  for (int k = 2; k < argc; ++k)
    if (std::string(argv[k]) == "--absent" && k + 1 < argc)
      absent.emplace_back(argv[++k]);
    else if (std::string(argv[k]) == "--every" && k + 1 < argc)
      every = std::max(1, std::atoi(argv[++k]));
    else
      sets.emplace_back(argv[k]);
  const RunOptions options = readRunOptions({}, splitOverrides(sets).estimators);
  cv::setNumThreads(1);
  SequenceReader sequence(argv[1], TruthImages::kNone);
  Wanted wanted;
  for (const SequenceObject& object : sequence.objects())
    wanted.add(object.name, {object.model, object.scale, object.y_up}, object.symmetries,
               options.training);
  wanted.present = wanted.size();
  for (const auto& file : absent)
    wanted.add(file.stem().string(), {file, 1, false}, {}, options.training);
  measure(sequence, every, std::move(wanted), options);
  return 0;
}

}  // namespace
}  // namespace diorama

int main(int argc, char** argv) { return diorama::main(argc, argv); }
