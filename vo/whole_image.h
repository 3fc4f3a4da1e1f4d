// How far one image is turned against another, from the whole of both at the coarsest level: rough,
// but from no more than the images (as PTAM's small blurry images, Klein and Murray 2008).
#pragma once

#include "core/camera.h"
#include "core/se3.h"
#include "vo/image_pyramid.h"

namespace diorama::vo {

struct WholeImageMatch {
  double correlation = -1;  // normalised, of what both see; -1 when nothing can be compared
  SE3 T_current_reference;  // a turn without roll, about the camera's centre
};

WholeImageMatch matchWholeImages(const Camera& camera, const ImagePyramid& reference,
                                 const ImagePyramid& current);

}  // namespace diorama::vo
