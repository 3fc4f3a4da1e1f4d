// The paths of a scene file: the camera's and the objects'.
//
//   path:
//     {type: spline, keyframes: [{t, position, AIM}, ...]}
//     {type: orbit, center, radius_m, height_m, start_rad, rate_rad_s, AIM (default: at the
//     centre),
//      azimuth_swing | radius_swing | height_swing: [amplitude, period_s] or a list of such}
//     {type: dolly, from, to, start_s, end_s, AIM}          minimum jerk, at rest before and after
//     {type: rest, position, AIM}
//     {type: follow, position: PATH, AIM}                   the positions of a path, aimed anew
//     {type: recorded, file, format: tum|euroc, T_world_recorded, time_scale, scale}
//     {type: sequence, segments: [{duration_s, join_s, ... a PATH}, ...]}
//   AIM is one of
//     look_at: [x, y, z] or the name of an object, then with `offset: [x, y, z]` in its frame;
//              roll_rad
//     quaternion_xyzw: [x, y, z, w]
//     yaw_rad: turned about the world's z axis (for objects)
//   and any path may have
//     shake: {amplitude_m, amplitude_rad, band_hz: [low, high], seed} or a list of such
//     glances: [{t: [start, end], turn_s, look_at, offset}, ...]
#pragma once

#include <filesystem>
#include <span>

#include "core/yaml.h"
#include "sim/motion_path.h"
#include "sim/scene.h"

namespace diorama {

// The value of a key `path`. Files are relative to `folder`; `objects` are those that can be looked
// at. Throws MissingInputError or InputError.
MotionPathPtr readPath(const YamlValue& value, const std::filesystem::path& folder,
                       std::span<const SceneObject> objects);

}  // namespace diorama
