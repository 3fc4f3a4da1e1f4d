// Reprojection of the map into a frame: one point per cell of the image, each found by feature
// alignment.
#pragma once

#include "vo/corners.h"
#include "vo/feature_alignment.h"
#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

struct ReprojectionResult {
  int tried = 0;                  // cells in which at least one settled point was searched for
  int matched = 0;                // = frame.features.size()
  std::vector<MapPoint*> missed;  // searched for, but not found
};

// Replaces frame.features by what is found from frame.T_world_camera.
ReprojectionResult reprojectMap(const Camera& camera, const Map& map, TrackedFrame& frame,
                                const VoOptions& options);

// The same with every settled point that is found, however many there are in a cell.
void measureAll(const Camera& camera, const Map& map, TrackedFrame& frame,
                const VoOptions& options);

// Grey levels by which a feature's patch differs from the frame, where it is most alike.
std::optional<double> patchDifference(const Camera& camera, const TrackedFrame& frame,
                                      const Feature& feature, const VoOptions& options);

// The observation whose patch serves as the reference for a view of the point from `camera_world`:
// the host's within host_view_angle_rad, else the nearest in angle; nothing beyond
// max_view_angle_rad.
const Observation* chooseReference(const MapPoint& point, const Vector3d& camera_world,
                                   const VoOptions& options);

// An aligned patch as a measurement in pixels of the image.
Measured measuredBy(const AlignedPatch& aligned, int level, const VoOptions& options);

// What a host says of its own corner: the patch is there by definition.
Measured hostMeasurement(const Vector2d& u_px, int level, const VoOptions& options);

// Grey levels by which a patch may differ from the image.
inline double largestPatchRms(double noise, const VoOptions& options) {
  return options.patch_rms_floor + options.patch_rms_noise * noise;
}

}  // namespace diorama::vo
