// The start: corners of a first keyframe are followed until there is parallax; two poses from
// objects, or the essential matrix when there is none, then give the first points.
#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <string>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/object_surfaces.h"
#include "vo/start_map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// Of the followed corners, in the first points: an object that moves itself takes its own along.
constexpr double kFewestAgree = 0.6;
constexpr double kMostParallax = 4;  // of the disparity that starts, after starts that were wrong
constexpr double kSmallestMotion = 0.25;  // of the disparity that starts: less is none

struct StartAttempt {
  bool started = false;
  bool metric = false;
  int points = 0;
  std::string reason;  // why it did not start, or where the scale comes from
};

class Initialisation {
 public:
  // All three must outlive it.
  Initialisation(const Camera& camera, const VoOptions& options, const ObjectSurfaces& surfaces)
      : camera_(camera), options_(options), surfaces_(surfaces) {}

  // Takes this frame as the first keyframe.
  void begin(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects);
  bool begun() const { return followed_.first.pyramid != nullptr; }
  bool sawObject() const;  // in the first keyframe
  // Finds the corners in the next frame.
  void follow(const TrackedFrame& frame);
  // With enough parallax: fills the map with two keyframes and the points that both see; where too
  // few corners agree in two frames, with those between, too. Without an object in both keyframes
  // only if the scale may remain unknown. A frame that does not start is one between.
  StartAttempt tryStart(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects,
                        bool without_scale, Map& map);
  // Why this first keyframe leads nowhere; empty while there is hope.
  std::string hopeless() const;
  void clear() { followed_ = {}; }
  // A start with so much parallax was wrong: the next one waits for more.
  void askForMore() { parallax_ = std::min(2 * parallax_, kMostParallax); }
  void askForLess() { parallax_ = 1; }  // there was not so much

  const FollowedCorners& followed() const { return followed_; }
  // The median, of the corners from the first keyframe to the last frame, px.
  double motionInImage() const;

 private:
  bool followCorner(const ImagePyramid& pyramid, FollowedCorner& corner) const;
  double medianDisparity(const Eigen::Quaterniond& R_second_first) const;
  int fewestPoints() const;
  bool hasParallax(std::span<const ObjectMeasurement> objects) const;
  std::ptrdiff_t countPoints(const SE3& T_first_second) const;
  std::optional<SE3> motionFromCorners() const;
  std::optional<SE3> metricMotion(std::span<const ObjectMeasurement> objects,
                                  const std::optional<SE3>& from_corners,
                                  std::string& source) const;
  StartAttempt startFrom(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects,
                         bool without_scale, bool with_between, Map& map);
  void keepBetween(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects);

  const Camera& camera_;
  const VoOptions& options_;
  const ObjectSurfaces& surfaces_;
  FollowedCorners followed_;
  bool contradicted_ = false;  // by objects: the corners are not of the world
  int frames_ = 0;             // since the first keyframe
  double parallax_ = 1;        // that starts, over that of the options
};

}  // namespace diorama::vo
