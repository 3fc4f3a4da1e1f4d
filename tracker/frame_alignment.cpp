#include "tracker/frame_alignment.h"

#include <algorithm>
#include <utility>

namespace diorama {

void FrameAlignment::setReference(ImagePyramid& image, const SE3& T_camera_model,
                                  const CoverMap& cover, bool good) {
  std::swap(image_, image);
  pending_ = {T_camera_model, cover};
  good_ = good;
}

DirectAlignment& FrameAlignment::reference() {
  if (pending_) direct_.setReference(image_, pending_->T_camera_model, pending_->cover);
  pending_.reset();
  return direct_;
}

SE3 FrameAlignment::align(const ImagePyramid& image, const SE3& predicted, const SE3& last,
                          PoseRefiner& refiner) {
  const DirectAlignment& direct = reference();
  if (!direct.ready()) return predicted;
  DirectAlignment::Result best = direct.align(image, predicted);
  const bool bad = usual_cost_ < 0 || best.cost > 1.5 * (usual_cost_ + 0.5);
  if (bad && refiner.pixelMotion(best.T_camera_model, last) > 4) {
    const DirectAlignment::Result other = direct.align(image, last);
    if (other.cost < best.cost) best = other;
  }
  usual_cost_ = usual_cost_ < 0
                    ? best.cost
                    : usual_cost_ + 0.2 * (std::min(best.cost, 2 * usual_cost_ + 1) - usual_cost_);
  // It can lock onto a static textured occluder: after a large step the edges vote.
  if (refiner.pixelMotion(best.T_camera_model, predicted) > options_.direct_vote_px &&
      refiner.edgeScore(predicted) > refiner.edgeScore(best.T_camera_model) + 0.1)
    return predicted;
  return best.T_camera_model;
}

}  // namespace diorama
