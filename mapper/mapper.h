// The map: a factor graph over camera poses and object poses (docs/conventions.md names the
// frames).
//
//   variables   T_world_camera(k), one per frame; T_world_object(j), static until it is seen to
//   move odometry    r = Log(Z^-1 T_world_camera(k)^-1 T_world_camera(k+1)) object      r =
//   Log(Z^-1 T_world_camera(k)^-1 T_world_object(j)), with a robust kernel
//
// An object that moves has a chain of its own, which does not tell where the camera is
// (moving_object.h), until it rests.
//
// The world is the camera frame of the first pose, which is held fixed. Residuals are whitened with
// the covariances of the measurements, which live in the right tangent [rho, phi] of Z.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/map_estimate.h"
#include "core/measurements.h"
#include "core/options.h"
#include "core/trajectory.h"
#include "mapper/chain_smoother.h"
#include "mapper/landmarks.h"
#include "mapper/motion_watch.h"

namespace diorama {

struct MapperOptions {
  SmootherOptions smoother;
  GateOptions gate;
  MotionOptions motion;
  int batch_iterations = 50;  // Levenberg-Marquardt steps of the final solution, at most
  // Kernel of object factors: none, huber, cauchy, or cauchy_tail (quadratic up to the width, then
  // as slowly growing as Cauchy's), for what the gate lets in; weights are those of the residuals
  // at the point of linearisation. The width is in standard deviations of the whitened
  // residual; 4.1 holds 99% of good measurements (chi-square with 6 degrees of freedom, 16.81).
  std::string object_kernel = "none";
  double object_kernel_width = 4.1;
  // Kernel of odometry factors, in the same way.
  std::string odometry_kernel = "none";
  double odometry_kernel_width = 4.1;
  // Standard deviations are multiplied with these: measurements are treated as independent, and
  // errors that are correlated in time count for less than that.
  double object_sigma_scale = 1;
  double odometry_sigma_scale = 1;
  // The odometry, by its measurements' `source`, that has a map of its own; empty: any. What
  // follows is for that one.
  std::string odometry_with_map = "";
  // The time constant of its error while it looks at the same place (odometry_anchor.h); 0: its
  // steps are all that it knows. Something known must be in view, within this angle of the axis.
  double odometry_memory_s = 0;
  double odometry_view_rad = 0.6;
  // One sigma of its scale's logarithm, as it starts, and after it has looked away from all that
  // is known (odometry_scale.h; measured there: 7%). 0: its scale is right.
  double odometry_scale_sigma = 0;
  double odometry_scale_sigma_elsewhere = 0.05;
  // Without odometry the camera is assumed to stand still within these times the length of the gap
  // (one sigma; no more than 2 m and 1 rad).
  double gap_m_s = 1;
  double gap_rad_s = 2;

  template <class V>
  void visit(V& v) {
    v("smoother", smoother);
    v("gate", gate);
    v("motion", motion);
    v("batch_iterations", batch_iterations, Range{1, 10000});
    v("object_kernel", object_kernel);
    v("object_kernel_width", object_kernel_width, kPositive);
    v("odometry_kernel", odometry_kernel);
    v("odometry_kernel_width", odometry_kernel_width, kPositive);
    v("object_sigma_scale", object_sigma_scale, kPositive);
    v("odometry_sigma_scale", odometry_sigma_scale, kPositive);
    v("odometry_with_map", odometry_with_map);
    v("odometry_memory_s", odometry_memory_s, kNotNegative);
    v("odometry_view_rad", odometry_view_rad, kPositive);
    v("odometry_scale_sigma", odometry_scale_sigma, kNotNegative);
    v("odometry_scale_sigma_elsewhere", odometry_scale_sigma_elsewhere, kPositive);
    v("gap_m_s", gap_m_s, kPositive);
    v("gap_rad_s", gap_rad_s, kPositive);
  }

  // What is wrong with these options, or nothing.
  std::optional<std::string> problem() const;
};

// One frame: addOdometry() or addGap() (but not for the first), addObject() for each measured
// object, update(). Single-threaded and repeatable to the last digit.
class Mapper {
 public:
  // The options must have no problem(); a programming error otherwise.
  explicit Mapper(const MapperOptions& options = MapperOptions());
  ~Mapper();
  Mapper(Mapper&&) noexcept;
  Mapper& operator=(Mapper&&) noexcept;

  // Poses in which an object looks the same; before its first measurement.
  void setSymmetries(const std::string& object, const Symmetries& symmetries);

  // Begins an empty map whose world is the camera frame at this time. Must come first.
  void start(int64_t timestamp_ns);
  bool started() const;

  // Appends the pose at to_ns. Its from_ns is the newest pose's time, or that of the last one
  // before a gap. Refused: another from_ns, health 0, a pose or covariance that is not finite, a
  // covariance that is not positive definite.
  AddResult addOdometry(const OdometryMeasurement& measurement);

  // Appends a pose for a frame whose motion nobody measured: a guess, by default (or when it is no
  // pose) that the camera stands still, right within gap_m_s and gap_rad_s. The objects tell where
  // it is, and odometry that finds its way again.
  AddResult addGap(int64_t timestamp_ns, const SE3& T_from_to = {});

  // Adds an object's pose, seen from a pose in the window; the first measurement of an object
  // places it. Refused: not claimed, health 0, no pose at that time, numbers as above, or outside
  // the gate; then it waits for others that agree with it.
  AddResult addObject(const ObjectMeasurement& measurement);

  // Whether an object is seen to move; addObject() says when it begins and ends.
  bool isMoving(const std::string& object) const;

  // What is known of an object's place counts no more when new measurements disagree: they will
  // make the place it stands for.
  void doubt(const std::string& object);

  // Smooths, and returns the belief.
  MapEstimate update();

  // The belief after the last update(); objects in the order of their first measurement.
  MapEstimate estimate() const;

  // T_camera_object at the newest pose, with the covariance that the joint belief gives it; nothing
  // for an object that was never measured.
  std::optional<ObjectPrediction> predict(const std::string& object) const;

  // T_camera_object at the newest pose, for whoever asks where the object is now: predict() joined
  // with what was accepted of it in that frame, if anything, at its own covariance
  // (present_view.h).
  std::optional<ObjectPrediction> view(const std::string& object) const;

  // Solves for everything until it converges, in batch; object covariances are those there.
  MapEstimate finish();

  // T_world_camera of every pose: as last solved for; after finish(), with all hindsight.
  Trajectory smoothedTrajectory() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace diorama
