// Measurements from what the tracker estimates: the one place where its model frame becomes the
// object's again.
#pragma once

#include <string>

#include "core/frame.h"
#include "core/measurements.h"
#include "tracker/pose_refiner.h"

namespace diorama {

class TrackReport {
 public:
  // The options must outlive this object.
  TrackReport(std::string source, std::string object, const Vector3d& centre_object,
              const TrackerOptions& options)
      : source_(std::move(source)),
        object_(std::move(object)),
        T_object_model_{Eigen::Quaterniond::Identity(), centre_object},
        options_(options) {}

  SE3 toModel(const SE3& T_camera_object) const { return T_camera_object * T_object_model_; }

  // Claimed when it is good and certain.
  ObjectMeasurement of(const Frame& frame, const Estimate& estimate, bool good) const;

  // Not claimed; the pose is the last one known.
  ObjectMeasurement notClaimed(const Frame& frame, const SE3& T_camera_model,
                               const std::string& reason) const;

 private:
  const std::string source_, object_;
  const SE3 T_object_model_;
  const TrackerOptions& options_;
};

}  // namespace diorama
