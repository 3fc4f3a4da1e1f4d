// Coarse alignment of grey values: pixels of the object in a good frame are lifted onto the model
// and found again in a new image. It bridges motions that the search along normals cannot.
#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "core/ray_query.h"
#include "tracker/edge_model.h"
#include "tracker/image_pyramid.h"
#include "tracker/surface_look.h"

namespace diorama {

class DirectAlignment {
 public:
  static constexpr int kCoarseLevel = 3, kFineLevel = 2;

  struct Result {
    SE3 T_camera_model;
    double cost = 0;  // grey levels: mean of the truncated differences after the brightness offset
  };

  // All references must outlive this object.
  DirectAlignment(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
                  const TrackerOptions& options);

  // Takes about direct_points uncovered pixels with strong gradient of the object in this image.
  void setReference(const ImagePyramid& image, const SE3& T_camera_model, const CoverMap& cover);
  void forget() { points_.clear(); }
  bool ready() const { return points_.size() >= kFewestPoints; }

  // Aligns from coarse to fine, both levels included.
  Result align(const ImagePyramid& image, const SE3& start, int coarse_level = kCoarseLevel,
               int fine_level = kFineLevel) const;

  // Mean truncated difference of a fraction of the points at the coarse level, without alignment.
  // `phase` picks the points.
  double screen(const ImagePyramid& image, const SE3& T_camera_model, size_t phase) const;

  // From random poses around the prediction and around the last pose: they are screened by their
  // grey values alone, and the best are aligned coarsely. The best of these, aligned.
  SE3 search(const ImagePyramid& image, const SE3& predicted, const SE3& last,
             uint32_t frame_index) const;

 private:
  static constexpr size_t kFewestPoints = 30;
  static constexpr size_t kLevels = ImagePyramid::kLevels;
  struct Point {
    Vector3d p;  // m, model frame
    // Of the reference image, per level: grey value (negative = not seen), d grey / d xi padded
    // to 8.
    std::array<float, kLevels> grey{};
    std::array<Eigen::Matrix<float, 8, 1>, kLevels> jacobian;
  };
  struct Difference {
    size_t point;
    float value;  // grey levels, new image minus reference
  };

  const Vector3d& rayThrough(int x, int y);
  void addPoint(const ImagePyramid& image, const SE3& T, const Matrix3d& R, const Vector2d& u_px,
                const Vector3d& p);
  void differences(const Image<uint8_t>& image, const SE3& T, int level,
                   std::vector<Difference>& out) const;
  Result alignLevel(const Image<uint8_t>& image, const SE3& start, int level) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const RayQuery& rays_;
  int object_;
  const TrackerOptions& options_;
  // z = 1; of the pixels of the fine level; 0 = not asked for yet, -1 = none
  Image<Vector3d> rays_in_camera_;
  std::vector<Point> points_;
};

}  // namespace diorama
