// Where the grey values of an earlier frame say that the object has gone.
#pragma once

#include <optional>

#include "tracker/direct_alignment.h"
#include "tracker/pose_refiner.h"

namespace diorama {

class FrameAlignment {
 public:
  // All references must outlive this object.
  FrameAlignment(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
                 const TrackerOptions& options)
      : direct_(model, camera, rays, object, options), options_(options) {}

  // The grey values of a frame that is good, or of a start that is to be carried until it is
  // proven. The image is taken, and an old one left in its place.
  void setReference(ImagePyramid& image, const SE3& T_camera_model, const CoverMap& cover,
                    bool good);
  // Whether there are grey values of a good frame.
  bool isGood() { return good_ && reference().ready(); }

  // From the prediction, and from the last pose when that ended badly. The prediction, without grey
  // values and where the edges speak for it.
  SE3 align(const ImagePyramid& image, const SE3& predicted, const SE3& last, PoseRefiner& refiner);

  // From random poses around both.
  SE3 search(const ImagePyramid& image, const SE3& predicted, const SE3& last,
             uint32_t frame_index) {
    return reference().search(image, predicted, last, frame_index);
  }

 private:
  // Points are lifted from the reference when they are wanted: most frames need none.
  DirectAlignment& reference();

  DirectAlignment direct_;
  struct Reference {
    SE3 T_camera_model;
    CoverMap cover;
  };
  ImagePyramid image_;                // of the reference
  std::optional<Reference> pending_;  // not lifted yet
  const TrackerOptions& options_;
  bool good_ = false;
  double usual_cost_ = -1;  // of the alignment when it went well; -1 = unknown
};

}  // namespace diorama
