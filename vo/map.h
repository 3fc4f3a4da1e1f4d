// The sparse map: keyframes, and points with the patches that saw them. Poses are T_world_camera;
// the world is the camera frame of the first keyframe.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/se3.h"
#include "vo/hidden_regions.h"
#include "vo/image_pyramid.h"
#include "vo/moving_objects.h"
#include "vo/vo_options.h"

namespace diorama::vo {

struct Keyframe;

// Where something was seen in an image.
struct Measured {
  Vector2d u_px = Vector2d::Zero();
  int level = 0;  // of the pyramid, where it was measured
  Matrix2d covariance_px2 = Matrix2d::Identity();
  Vector2d normal = Vector2d::Zero();  // of an edgelet, of unit length: the rest is not measured

  bool isEdgelet() const { return !normal.isZero(0); }
  // How far off it is by a residual, px at its level.
  double errorPx(const Vector2d& residual_px) const {
    return (isEdgelet() ? std::abs(normal.dot(residual_px)) : residual_px.norm()) *
           levelScale(level);
  }
};

// Where a keyframe saw a point.
struct Observation : Measured {
  Keyframe* keyframe = nullptr;
};

struct MapPoint {
  Vector3d p_world;
  // Of p_world, m^2: how well its keyframes see where it is.
  Matrix3d covariance = Matrix3d::Zero();
  // What was assumed of its depth before it was measured.
  Vector3d assumed_p_world = Vector3d::Zero();
  Matrix3d assumed_information = Matrix3d::Zero();
  std::vector<Observation> observations;  // the first is the host: its patch is the reference
  // Of the lengths around it when it was settled, relative to those of the start.
  double scale_variance = 0;
  int agreed = 0;    // frames in which it agreed with the pose
  int failed = 0;    // frames in a row in which it did not
  bool bad = false;  // to be removed
  bool settled =
      true;  // false: a corner whose depth the filter still looks for; only its host saw it
  bool edgelet = false;  // on an edge, and found across it only
  int mark = 0;          // bundle adjustment's own
};

// A point found in an image.
struct Feature : Measured {
  MapPoint* point = nullptr;
  // Whitened by covariance_px2, set by pose refinement; an edgelet's is a single number.
  Vector2d residual = Vector2d::Zero();
};

struct TrackedFrame {
  int64_t timestamp_ns = 0;
  std::shared_ptr<const ImagePyramid> pyramid;
  double noise = 0;  // grey levels
  // Pyramid levels that the motion during the exposure may have blurred: fast motion, at least.
  int blurred_levels = 0;
  bool isFast() const { return blurred_levels >= 3; }  // little of the map is found for this alone
  SE3 T_before_now;           // motion since the frame before, as far as it is known
  double exposure_share = 0;  // the shutter is open for so much of the time between frames
  SE3 T_world_camera;
  std::vector<Feature> features;
  double scale_variance = 0;  // of the lengths of what it sees, relative to those of the start
  bool covered = false;       // much of the map that should be seen is not
  HiddenRegions hidden;
  MovingObjects moving;
  // Whether something new may begin here.
  bool isOpen(const Vector2d& u_px, int at_level) const {
    return !hidden.contains(u_px) && !moving.contains(u_px, at_level);
  }
};

// Without a pyramid when the image does not fit the camera.
TrackedFrame makeFrame(const Frame& frame, const Camera& camera, const VoOptions& options);

// What was measured of an object in a keyframe.
struct ObjectObservation {
  size_t object = 0;  // index into Map::objects
  SE3 T_camera_object;
  Matrix6d information;  // right tangent [rho, phi]
};

struct Keyframe : TrackedFrame {
  int id = 0;          // counts from 0, never used again
  size_t tracked = 0;  // features when it was made
  std::vector<ObjectObservation> objects;
  int slot = -1;    // bundle adjustment's own
  size_t view = 0;  // also
};

struct MapObject {
  std::string name;
  SE3 T_world_object;
};

struct DepthRange {
  double median_m = 1, nearest_m = 0.5;  // nearest: the 5th percentile
};

class Map {
 public:
  std::vector<std::unique_ptr<Keyframe>> keyframes;  // oldest first
  std::vector<std::unique_ptr<MapPoint>> points;
  std::vector<MapObject> objects;

  // Its features become observations; points that are seen twice thereby are adjusted from now on,
  // and count as settled.
  Keyframe& addKeyframe(const TrackedFrame& frame);
  // A point seen by its host; a feature of the host from now on.
  MapPoint& addPoint(Keyframe& host, const Vector3d& p_world, const Measured& seen);
  // Removes the keyframe and what it saw; points that nobody else saw become bad.
  void removeKeyframe(Keyframe& keyframe);
  // Frees bad points; afterwards nobody but the keyframes may have known them.
  void removeBadPoints();
  void stretch(const Vector3d& centre, double factor);  // all lengths, about a point
  size_t objectIndex(const std::string& name);          // added when it is new
  void clear();

 private:
  int next_id_ = 0;
};

// Counts for each point whether it agreed with an accepted pose: the frame's features did, `failed`
// were not found or disagreed. Points that fail often and were seen by few keyframes become bad.
void judgePoints(const TrackedFrame& frame, const std::vector<MapPoint*>& failed);

// Its depth counts as measured from here on, in this frame's lengths.
void settle(const TrackedFrame& frame, MapPoint& point);

// Of the lengths of what a frame sees, relative to those of the start: what was vague when its
// points were settled they have in common; their own depths are vague one by one. A frame without
// such points is as vague as the one before.
double scaleVariance(const TrackedFrame& frame, const TrackedFrame& before);

int settledFeatures(const TrackedFrame& frame);
std::vector<Vector3d> settledPoints(const Map& map);

// Whether a point is known to a few percent of its distance; how many of the features are such.
bool isCertain(const MapPoint& point, const TrackedFrame& frame);
int certainFeatures(const TrackedFrame& frame);

// Depths of a frame's features; the default when it has fewer than five.
DepthRange depthRange(const TrackedFrame& frame);

}  // namespace diorama::vo
