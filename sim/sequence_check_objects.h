// Whether depth and masks are those of a tracked object's mesh at its pose: one ray per pixel.
#pragma once

#include <functional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/se3.h"
#include "sim/embree_ray_query.h"

namespace diorama {

struct ObjectImages {
  Image<float> depth_m;                // of the frame; empty: not compared
  const Image<uint8_t>& mask;          // the whole silhouette; empty: not compared
  std::function<bool(int, int)> seen;  // whether a pixel shows the object
};

// Pixels that are not as the mesh has them; the first of each kind by name.
struct ObjectDifferences {
  int64_t pixels = 0;  // compared
  int visible = 0;     // pixels that show the object
  int depth = 0, mask = 0;
  int hidden = 0;  // counted as hidden, but nothing stands before them
  int depth_x = 0, depth_y = 0, mask_x = 0, mask_y = 0, hidden_x = 0, hidden_y = 0;
  double depth_off_m = 0;  // at the first
};

class ObjectComparison {
 public:
  ObjectComparison(const Camera& camera, const std::vector<Mesh>& meshes);

  // `T_camera_object` of an image row; the same for all rows of a global shutter.
  ObjectDifferences compare(int object, const std::function<SE3(int)>& T_camera_object,
                            const ObjectImages& images) const;

 private:
  struct Box {
    int x0, y0, x1, y1;  // both ends included
  };
  struct View;
  Box imageBox(int object, const SE3& T_camera_object) const;
  void comparePixel(const View& view, int x, int y, const ObjectImages& images,
                    ObjectDifferences& result) const;

  Camera camera_;
  EmbreeRayQuery rays_;
  std::vector<std::pair<Vector3d, Vector3d>> corners_;  // smallest and largest of each mesh
};

}  // namespace diorama
