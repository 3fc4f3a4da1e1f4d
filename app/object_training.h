// Object databases: filmed from the CAD model alone, read from a file, or kept from an earlier run.
#pragma once

#include <filesystem>
#include <optional>

#include "core/object_model.h"
#include "tracker/object_database.h"

namespace diorama {

// Where a model comes from.
struct ModelFile {
  std::filesystem::path mesh;
  double scale = 1;   // metres per unit of the file
  bool y_up = false;  // the file's y axis points up
};

// Films the model alone, under even light, from all around, and learns from the pictures: some
// seconds. Throws MissingInputError or InputError.
ObjectDatabase trainFrom(const ModelFile& file, const ObjectModel& model,
                         const TrainingOptions& options);

// The same, or what it gave before for the same model and options (cacheFolder()/databases).
ObjectDatabase trainOrRemember(const ModelFile& file, const ObjectModel& model,
                               const TrainingOptions& options);

}  // namespace diorama
