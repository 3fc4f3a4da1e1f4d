// Whether an object looks in an image as it did in its training: grey values of points all over
// the side that shows.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/object_model.h"
#include "core/ray_query.h"
#include "core/se3.h"

namespace diorama {

// One view of the training.
struct DatabaseLook {
  Vector3f direction = Vector3f::Zero();  // unit, object frame: from the object towards the camera
  float side_m = 0;                       // of the patch of surface that a grey value is a mean of
  std::vector<Vector3f> points;           // m, object frame
  std::vector<Vector3f> normals;          // unit, of the surface there
  std::vector<uint8_t> grey;              // one per point
};

// Means over squares of an image.
class MeanImage {
 public:
  explicit MeanImage(const Image<uint8_t>& image);
  // Around a pixel, at least one pixel wide; nothing where the square is not wholly in the image.
  std::optional<double> mean(const Vector2d& u_px, double side_px) const;

 private:
  int width_, height_;
  std::vector<uint64_t> sums_;  // of all pixels above and to the left
};

// What the camera sees of the object in the picture, at points on a grid.
DatabaseLook takeLook(const Image<uint8_t>& picture, const Camera& camera, const RayQuery& rays,
                      int object_index, const SE3& T_camera_object, const Vector3d& centre_object);

// How well the image agrees with the look from nearest to the same side, in [-1, 1]: the partial
// correlation of the logarithms of grey values, given the surface normals. Light makes each side
// of an object brighter or darker, but what is printed on it stays. Nothing when the object is too
// plain to tell, or too little of it is in the image.
std::optional<double> compareLooks(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                   const Camera& camera, const SE3& T_camera_object,
                                   const Vector3d& centre_object);

// Whether a look shows too little print to be compared.
bool isPlain(const DatabaseLook& look);

}  // namespace diorama
