// The pose of a camera from matches between places of an object and pixels, many of them wrong.
#pragma once

#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/random.h"
#include "core/se3.h"
#include "tracker/detector_options.h"

namespace diorama {

struct PointMatch {
  Vector3d p_object;        // m
  Vector3d view_direction;  // unit, object frame: from where the place was seen in the training
  Vector2d u_px;
};

// Matches that a pose agrees with, ascending. Of several matches of one pixel the first counts.
std::vector<int> agreeingMatches(const std::vector<PointMatch>& matches, const Camera& camera,
                                 const SE3& T_camera_object, double inlier_px);

// Of the pose (right tangent), by the places of the given matches alone; their errors are shared by
// neighbours.
Matrix6d covarianceByMatches(const std::vector<PointMatch>& matches, const std::vector<int>& used,
                             const Camera& camera, const SE3& T_camera_object, double inlier_px);

struct RansacPose {
  SE3 T_camera_object;
  std::vector<int> inliers;  // ascending
};

// RANSAC over minimal samples of P3P (Ke and Roumeliotis, CVPR 2017) or EPnP (Lepetit,
// Moreno-Noguer and Fua, IJCV 2009), then robust Gauss-Newton over all inliers. Nothing with fewer
// than min_inliers, or when they lie within min_spread * diameter. The same input gives the same
// pose.
std::optional<RansacPose> findPose(const std::vector<PointMatch>& matches, const Camera& camera,
                                   double diameter, const DetectorOptions& options,
                                   const Random& random, uint32_t frame);

// The pose that explains a flat, distant set of places nearly as well: their plane tilted the other
// way (Schweighofer and Pinz, Robust pose estimation from a planar target, PAMI 2006).
SE3 tiltedTheOtherWay(const SE3& T_camera_object, const std::vector<PointMatch>& matches,
                      const std::vector<int>& inliers);

}  // namespace diorama
