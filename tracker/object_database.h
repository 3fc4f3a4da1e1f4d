// What is known about an object's looks: features on its surface, seen from all around.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/object_model.h"
#include "core/ray_query.h"
#include "core/se3.h"
#include "tracker/appearance.h"
#include "tracker/database_options.h"
#include "tracker/features.h"

namespace diorama {

struct DatabaseFeature {
  Vector3f p_object;  // m, on the surface
  Vector3f normal;    // unit, towards the camera that saw it
  int32_t view = 0;
};

struct ObjectDatabase {
  std::string name;
  std::string mesh_sha256;  // of the mesh that it was made from (meshChecksum)
  FeatureKind kind = FeatureKind::kSift;
  std::vector<SE3> views;  // T_camera_object
  std::vector<DatabaseFeature> features;
  std::vector<uint8_t> descriptors;  // features.size() rows
  std::vector<DatabaseLook> looks;   // from all around
};

// Of the shape: positions and triangles.
std::string meshChecksum(const Mesh& mesh);

// The camera that films a training, and the poses T_camera_object that it wants: for each distance,
// directions all around.
const Camera& trainingCamera();
std::vector<SE3> trainingViews(const Mesh& mesh, const TrainingOptions& options);

// Detects features in pictures and lifts them to the surface by rays. `picture(k)`, asked for in
// order, shows the object alone from trainingViews()[k]; the ray query holds its mesh as object
// number object_index. An object without any print gives a database without features, and that is
// right.
ObjectDatabase trainDatabase(const ObjectModel& model, const RayQuery& rays, int object_index,
                             const std::function<Frame(int)>& picture,
                             const TrainingOptions& options);

// One file: a version, the content, and a checksum (docs/formats.md). Throws OutputError.
void writeDatabase(const ObjectDatabase& database, const std::filesystem::path& file);
// Throws MissingInputError, or InputError when the file is no database, of another version, or
// damaged.
ObjectDatabase readDatabase(const std::filesystem::path& file);

}  // namespace diorama
