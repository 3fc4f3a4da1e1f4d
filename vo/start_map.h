// The first map: points where corners, followed from a first keyframe to a second one, meet, and
// whether they move as objects say.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/object_surfaces.h"
#include "vo/patch.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// A corner of the first keyframe and where it is now.
struct FollowedCorner {
  Vector2d u_first_px, u_px;
  Vector3d bearing_first;  // z = 1
  int level = 0;
  Measured measured;              // u_px as a measurement
  std::vector<Measured> between;  // in the frames between
  std::vector<Patch> patches;     // one per level from the corner's own upwards
};

// One of the frames between the first keyframe and the second one.
struct FrameBetween {
  TrackedFrame frame;
  std::vector<ObjectMeasurement> objects;
};

// All since the first keyframe, and what was seen of objects in that.
struct FollowedCorners {
  TrackedFrame first;
  std::vector<ObjectMeasurement> objects;
  std::vector<FollowedCorner> corners;
  std::vector<FrameBetween> between;
};

// The camera's motion T_then_now, as each object seen both times tells it.
std::vector<SE3> motionsOfObjects(std::span<const ObjectMeasurement> then,
                                  std::span<const ObjectMeasurement> now);

// In the first camera, when the corner's rays meet in front of both.
std::optional<Vector3d> meetingPoint(const Camera& camera, const FollowedCorner& corner,
                                     const SE3& T_second_first);

// Two keyframes, the second at this frame, and the points that both see; with a few of the frames
// between, when they are asked for.
void fillMap(const Camera& camera, const FollowedCorners& followed, const TrackedFrame& frame,
             std::span<const ObjectMeasurement> objects, const SE3& T_first_second,
             bool with_between, const VoOptions& options, Map& map);

// Bundle adjustment of all of it.
void adjustMap(const Camera& camera, bool metric, const VoOptions& options, Map& map);

// Whether the keyframes are where the objects have them.
bool objectsAgree(const Map& map);

// Corners that are not on objects and agree with their motion over several frames, closely, are of
// the world that the objects rest in: whether so many do, and that they are more than a few of all.
bool enoughAgreeThroughout(const Camera& camera, const FollowedCorners& followed,
                           const ObjectSurfaces& surfaces, int fewest, const Map& map);

}  // namespace diorama::vo
