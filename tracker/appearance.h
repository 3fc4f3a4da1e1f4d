// Whether an object looks in an image as it did in its training: colours of points all over the
// side that shows.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/object_model.h"
#include "core/ray_query.h"
#include "core/se3.h"

namespace diorama {

// One view of the training.
struct DatabaseLook {
  Vector3f direction = Vector3f::Zero();  // unit, object frame: from the object towards the camera
  float side_m = 0;                       // of the patch of surface that a colour is a mean of
  std::vector<Vector3f> points;           // m, object frame
  std::vector<Vector3f> normals;          // unit, of the surface there
  std::vector<Rgb8> colors;               // one per point; three like numbers from a grey camera
};

// Means over squares of a frame: of its colours, or of its grey values where it has none.
class MeanImage {
 public:
  explicit MeanImage(const Frame& frame);
  bool hasColors() const { return channels_ == 3; }
  // Mean of the logarithms of brightness, as of lookValue(), all over the frame.
  float brightness() const { return brightness_; }
  // Red, green and blue around a pixel, or three times the grey value, of a square at least one
  // pixel wide; nothing where it is not wholly in the image.
  std::optional<Vector3f> mean(const Vector2d& u_px, double side_px) const;

 private:
  template <class ValueAt>
  void sumUp(const ValueAt& value_at);

  int width_, height_, channels_;
  float brightness_ = 0;
  std::vector<uint32_t> sums_;  // of all pixels above and to the left, channel by channel
};

// What is compared of a colour: logarithms of its brightness (ITU-R BT.601), of red over green and
// of blue over green; zeros for the latter where there are grey values alone.
Vector3f lookValue(const Vector3f& rgb, bool has_colors = true);
Vector3f lookValue(const Rgb8& color, bool has_colors = true);

// What the camera sees of the object in the picture, at points on a grid.
DatabaseLook takeLook(const Frame& picture, const Camera& camera, const RayQuery& rays,
                      int object_index, const SE3& T_camera_object, const Vector3d& centre_object);

// The same with patches twice as large.
DatabaseLook coarser(const DatabaseLook& look);

// The one taken from nearest to the camera's side; an empty one when there are none.
const DatabaseLook& nearestLook(const std::vector<DatabaseLook>& looks, const SE3& T_camera_object,
                                const Vector3d& centre_object);

// How well the image agrees with the look from nearest to the same side, in [-1, 1]: the partial
// correlation of the logarithms of brightness, red over green and blue over green, given the
// surface normals. Light makes each side of an object brighter, darker or warmer, but what is
// printed on it stays. Nothing when the object is too plain to tell, or too little of it is in the
// image. At most so many points are compared.
std::optional<double> compareLooks(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                   const Camera& camera, const SE3& T_camera_object,
                                   const Vector3d& centre_object, int most_points = 1000);

// The part of an image on one side of a straight line: the whole, unless it is told otherwise.
struct ImagePart {
  Vector2d normal = Vector2d::Zero();
  double offset_px = 0;
  bool contains(const Vector2d& u_px) const { return normal.dot(u_px) <= offset_px; }
};

// The same of what a straight line leaves of the object: something may stand before the rest. Of
// lines in 16 directions that leave half of the points or more, the one for which the agreement
// less `cost` times the share of the points behind the line is greatest; the whole where no line
// gains anything.
struct PartialLook {
  std::optional<double> agreement = {};
  double share = 1;  // of the points
  ImagePart part = {};
};
PartialLook compareLooksInPart(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                               const Camera& camera, const SE3& T_camera_object,
                               const Vector3d& centre_object, double cost, int most_points = 1000);

// Whether a look shows too little print to be compared.
bool isPlain(const DatabaseLook& look);
// Whether none shows more than light makes of a surface without any.
bool arePlain(const std::vector<DatabaseLook>& looks);

// How likely the colours in the image are those of the look from nearest to the same side, and not
// any others: for what is plain. The mean over the points of the logarithm of a ratio of
// likelihoods, 1 at most; light and camera may change colours, and brightness against that of the
// whole image, by some. Nothing when the image has none, or too little of the object is in it.
std::optional<double> compareColors(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                    const Camera& camera, const SE3& T_camera_object,
                                    const Vector3d& centre_object, int most_points = 1000);

}  // namespace diorama
