// What a run folder says in JSON about its map and its objects.
#pragma once

#include <string>
#include <vector>

#include "core/map_estimate.h"
#include "core/object_model.h"

namespace diorama {

// map.json: T_world_object (4x4, row-major) and covariance (6x6) of each object.
std::string mapJson(const MapEstimate& map);

// models.json: coarse meshes, for the report.
std::string modelsJson(const std::vector<ObjectModel>& models);

}  // namespace diorama
