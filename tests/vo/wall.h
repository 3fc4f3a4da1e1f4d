// A camera that looks straight at a wall 2 m away.
#pragma once

#include <vector>

#include "core/camera.h"

namespace diorama::vo::test {

inline const Camera& wallCamera() {
  static const Camera camera(
      CameraParameters{CameraModel::kPinhole, 640, 480, 500, 500, 320, 240, {}});
  return camera;
}

// Of the wall, in the camera's frame.
inline Vector3d pointOnWall(const Vector2d& u_px) {
  return 2 * wallCamera().unproject(u_px).value();
}

// Pixels in rows, the first of them half a step from the image's outline.
inline std::vector<Vector2d> gridOfPixels(int step_x, int step_y) {
  std::vector<Vector2d> pixels;
  for (int y = step_y / 2; y < wallCamera().height(); y += step_y)
    for (int x = step_x / 2; x < wallCamera().width(); x += step_x)
      pixels.push_back(Vector2d(x, y));
  return pixels;
}

}  // namespace diorama::vo::test
