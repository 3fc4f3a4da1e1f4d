// Where in a frame known objects are seen that move in the world: nothing there belongs to the map.
#pragma once

#include <span>
#include <vector>

#include "core/camera.h"
#include "core/measurements.h"

namespace diorama::vo {

class ObjectSurfaces;

class MovingObjects {
 public:
  MovingObjects() = default;  // none
  // As measured in the frame. Camera and surfaces must outlive it.
  MovingObjects(const Camera& camera, const ObjectSurfaces& surfaces,
                std::span<const ObjectMeasurement> objects)
      : camera_(&camera), surfaces_(&surfaces), objects_(objects.begin(), objects.end()) {}

  // Whether some of the patch around u_px, of that pyramid level, lies on one of them.
  bool contains(const Vector2d& u_px, int level) const;
  // Whether a point, in the camera's frame, lies on the near side of one, as far as can be told.
  bool carry(const Vector3d& p_camera) const;

 private:
  const Camera* camera_ = nullptr;
  const ObjectSurfaces* surfaces_ = nullptr;
  std::vector<ObjectMeasurement> objects_;
};

}  // namespace diorama::vo
