// Where the camera's rays meet known objects: what is seen there has a depth without any parallax.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/measurements.h"
#include "core/ray_query.h"
#include "vo/epipolar_search.h"
#include "vo/vo_options.h"

namespace diorama::vo {

class ObjectSurfaces {
 public:
  ObjectSurfaces() = default;  // the shape of no object is known
  // The objects' names, in the order in which `rays` counts them.
  ObjectSurfaces(std::shared_ptr<const RayQuery> rays, std::vector<std::string> names)
      : rays_(std::move(rays)), names_(std::move(names)) {}

  // Whether the shapes of all objects that are measured are known.
  bool know(std::span<const ObjectMeasurement> objects) const;

  // Depth of what is seen at u_px, when all of the patch around it (of a corner of that pyramid
  // level) lies on one of the objects, which are where they are measured to be. Its sigma is that
  // of the object's pose. Nothing elsewhere, and on surfaces that are seen edge-on.
  std::optional<InverseDepth> depthAt(const Camera& camera, const Vector2d& u_px, int level,
                                      std::span<const ObjectMeasurement> objects,
                                      const VoOptions& options) const;

  // Whether some of the patch lies on one of the objects.
  bool touch(const Camera& camera, const Vector2d& u_px, int level,
             std::span<const ObjectMeasurement> objects) const;

  // z in the camera of the nearest surface that is seen there.
  std::optional<double> distanceTo(const Camera& camera, const Vector2d& u_px,
                                   std::span<const ObjectMeasurement> objects) const;

 private:
  struct Hit {
    const ObjectMeasurement* object;
    RayHit at;
    double depth_m;  // z in the camera
  };
  std::optional<Hit> meet(const Camera& camera, const Vector2d& u_px,
                          std::span<const ObjectMeasurement> objects) const;

  std::shared_ptr<const RayQuery> rays_;
  std::vector<std::string> names_;
};

}  // namespace diorama::vo
