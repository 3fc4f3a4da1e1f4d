#include "vo/relocalisation.h"

#include <algorithm>

#include "vo/object_scale.h"
#include "vo/pose_refinement.h"
#include "vo/reprojection.h"
#include "vo/sparse_alignment.h"
#include "vo/whole_image.h"

namespace diorama::vo {
namespace {

constexpr size_t kMostTried = 4;           // keyframes: each costs as much as tracking a frame
constexpr double kLeastCorrelation = 0.3;  // with less a keyframe shows something else

struct Likeness {
  const TrackedFrame* frame;
  WholeImageMatch match;
};

}  // namespace

std::vector<SE3> posesFromImages(const Camera& camera, const TrackedFrame& frame,
                                 const TrackedFrame& last, const Map& map,
                                 const VoOptions& options) {
  std::vector<Likeness> alike;
  const auto compare = [&](const TrackedFrame& known) {
    const WholeImageMatch match = matchWholeImages(camera, *known.pyramid, *frame.pyramid);
    if (match.correlation >= kLeastCorrelation) alike.push_back({&known, match});
  };
  compare(last);
  for (const auto& keyframe : map.keyframes) compare(*keyframe);
  std::stable_sort(alike.begin(), alike.end(), [](const Likeness& a, const Likeness& b) {
    return a.match.correlation > b.match.correlation;
  });
  alike.resize(std::min(alike.size(), kMostTried));

  std::vector<SE3> poses;
  for (const Likeness& known : alike)
    if (const auto aligned = alignSparsely(camera, *known.frame, *frame.pyramid,
                                           known.match.T_current_reference, options))
      poses.push_back(known.frame->T_world_camera * aligned->T_current_reference.inverse());
  return poses;
}

std::vector<SE3> posesFromObjects(std::span<const ObjectMeasurement> objects, const Map& map) {
  std::vector<SE3> poses;
  for (const ObjectMeasurement& seen : objects)
    for (const MapObject& known : map.objects)
      if (isUsable(seen) && known.name == seen.object)
        poses.push_back(known.T_world_object * seen.T_camera_object.inverse());
  return poses;
}

// What is found first leads to more.
Assessment findInMap(const Camera& camera, const Map& map, const std::vector<SE3>& poses,
                     TrackingQuality& quality, const VoOptions& options, TrackedFrame& frame) {
  for (const SE3& T_world_camera : poses) {
    frame.T_world_camera = T_world_camera;
    reprojectMap(camera, map, frame, options);
    refinePose(camera, frame, options);
    const ReprojectionResult reprojected = reprojectMap(camera, map, frame, options);
    const PoseRefinement refined = refinePose(camera, frame, options);
    const Assessment assessment = quality.assessRecovery(reprojected, refined);
    if (assessment.good) return assessment;
  }
  return {};
}

}  // namespace diorama::vo
