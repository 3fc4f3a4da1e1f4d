// What known objects tell the map: where they are, and through them the scale of everything.
#pragma once

#include <optional>
#include <span>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// Adds what was measured of objects in a keyframe; an object's first measurement places it in the
// world. Measurements that are not claimed or not finite are left out. Returns how many were added.
int attachObjects(Map& map, Keyframe& keyframe, std::span<const ObjectMeasurement> objects,
                  const VoOptions& options);

// Places an object where the newest keyframe that saw it saw it.
void placeObject(Map& map, size_t object);

// Whether a measurement can be used at all.
bool isUsable(const ObjectMeasurement& measurement);

// Of its pose, as the options have it: no measurement is better than their least sigmas.
Matrix6d covarianceOf(const ObjectMeasurement& measurement, const VoOptions& options);

// The translation of T_a_b that an object at rest implies, given the rotation: p_a - R_a_b p_b.
Vector3d pathOfObject(const SE3& T_a_b, const SE3& T_a_object, const SE3& T_b_object);

// What the lengths of a map without scale are to be multiplied with: camera motions between
// keyframes, as objects seen in both tell them, against those of the map. Nothing while the motions
// are too short for that.
std::optional<double> scaleFromObjects(const Map& map);

// Residual and Jacobians of an object observation (right perturbations of both poses).
struct ObjectResidual {
  Vector6d r;
  Matrix6d J_camera, J_object;
};
ObjectResidual objectResidual(const SE3& T_world_camera, const SE3& T_world_object,
                              const SE3& T_camera_object_measured);

// Relative standard deviation of the map's scale, as far as the object observations of its
// keyframes tell it: the shape of the camera path is taken as known. Infinite without such
// observations.
double scaleSigma(const Map& map);

// For how long objects are asked about the scale: until it is known well enough, and for a limited
// time only once they began to tell it.
class ScaleLearning {
 public:
  explicit ScaleLearning(const VoOptions& options) : options_(options) {}

  void beginWithout() { sigma_ = 1; }  // a path may be half as long or twice
  void begin(int64_t now_ns) { since_ns_ = now_ns; }
  bool begun() const { return since_ns_.has_value(); }  // the map is metric
  bool wantsObjects(int64_t now_ns) const;
  void assess(const Map& map);  // after each adjustment
  // Relative, since a start without scale; 0 when it is known well enough.
  double sigma() const { return known_ ? 0 : sigma_; }

 private:
  const VoOptions& options_;
  std::optional<int64_t> since_ns_;
  bool known_ = false;
  double sigma_ = 0;
};

}  // namespace diorama::vo
