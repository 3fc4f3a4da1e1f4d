// The report of one run, or of two side by side, from their folders.
//
// The data of the page is JSON: {kind: "run", runs: [RUN...]}, RUN = {name, folder, metrics
// (metrics.json), command, verdict ([{text, met, detail}]), options ([[key, value, usual value]]),
// world ("truth" or "estimate": in whose frame the poses are, z up), frame [..], t_s [..],
// camera {estimated, true: [pose..], error_m [..]}, objects [{name, mesh, estimated, true:
// [pose..], error_m, error_rad, held, health, visible, ellipsoid: [..]}, map: {pose, ellipsoid}],
// odometry {health [..]}, events [{t_s, source, event, value, reason}], timing {odometry_ms, ...},
// worst [{frame, t_s, object, error_m, picture}], points [x, y, z, ...], video}. A list has one
// entry per frame, null where nothing is known; a pose is [x, y, z, qx, qy, qz, qw]; an ellipsoid
// (one sigma) is [radii, quaternion], in the frame of the pose.
#pragma once

#include <filesystem>
#include <vector>

namespace diorama {

// Whether this is the folder of a complete run.
bool isRunFolder(const std::filesystem::path& folder);

// Writes the page. Files of a run that are missing leave their part of it empty; throws
// MissingInputError without metrics.json, InputError for a file that is none of a run's.
void writeRunReport(const std::vector<std::filesystem::path>& runs,
                    const std::filesystem::path& output);

}  // namespace diorama
