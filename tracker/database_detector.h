// Detection of known objects with their databases: see database_detector.cpp for the story.
#pragma once

#include <memory>
#include <vector>

#include "core/camera.h"
#include "core/object_detector.h"
#include "core/object_model.h"
#include "core/ray_query.h"
#include "tracker/detector_options.h"
#include "tracker/object_database.h"
#include "tracker/tracker_options.h"

namespace diorama {

struct DetectorObject {
  ObjectModel model;
  ObjectDatabase database;
};

class DatabaseDetector : public ObjectDetector {
 public:
  // The ray query holds the meshes of the objects, in their order. Throws InputError when a
  // database belongs to another mesh.
  DatabaseDetector(std::vector<DetectorObject> objects, Camera camera,
                   std::shared_ptr<const RayQuery> rays, DetectorOptions options = {},
                   TrackerOptions tracker_options = {});
  ~DatabaseDetector() override;

  std::vector<std::optional<Detection>> detect(const Frame& frame,
                                               std::span<const int> objects) override;

 private:
  class Picture;  // a frame, and what is made of it
  class Finder;   // of one object
  Camera camera_;
  DetectorOptions options_;
  std::vector<std::unique_ptr<Finder>> finders_;
};

}  // namespace diorama
