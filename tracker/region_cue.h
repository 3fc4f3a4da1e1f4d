// The colours on both sides of an object's outline: where they change from the object's to those
// beside it, even where light and shadow draw stronger edges. A Gaussian is fitted to what the
// pixels of each normal say of the outline's place (after Stoiber et al., SRT3D: A Sparse
// Region-Based 3D Object Tracking Approach, IJCV 2022).
#pragma once

#include <array>
#include <vector>

#include "core/camera.h"
#include "core/ray_query.h"
#include "tracker/edge_search.h"
#include "tracker/pose_solver.h"

namespace diorama {

// Where pixels along the normal of one sample want the outline.
struct OutlinePlace {
  int sample = 0;
  Vector2d u_px, outwards;
  double mean_px = 0;      // along `outwards`
  double information = 0;  // 1/px^2; 0 = the pixels tell nothing
};

class OutlineColors {
 public:
  static constexpr int kReach = 8;  // px, on each side

  bool known() const { return known_; }
  // From a pose that is right; rates of the running means.
  void learn(const EdgePicture& picture, const std::vector<SampleSides>& outline, float inside_rate,
             float beside_rate);
  // Whether most of the pixels of the object beside a sample have colours that were seen before.
  bool isFamiliar(const EdgePicture& picture, const SampleSides& sample) const;
  // Those of the candidates that would leave the object's colours outside, or others inside, by
  // `doubt` (of the likelihood's logarithm) more than another place does, are not like before.
  OutlinePlace place(const EdgePicture& picture, const SampleSides& sample) const;
  void doubt(const EdgePicture& picture, const SampleSides& sample, float doubt,
             EdgeObservation& observation) const;

 private:
  static constexpr int kLevels = 16, kColors = kLevels * kLevels * kLevels;
  static constexpr int kPlaces = 2 * kReach + 1;
  // log_likelihood[k]: of the outline k - inner_px - 0.5 px outwards. Returns their number.
  int likelihoods(const EdgePicture& picture, const SampleSides& sample,
                  std::array<float, kPlaces>& log_likelihood) const;
  static int colorAt(const EdgePicture& picture, const Vector2d& u_px);

  bool known_ = false;
  std::vector<float> inside_, beside_;  // shares of the colours
  std::vector<float> ratio_;            // logarithm of the first over the second
};

class RegionCue : public Cue {
 public:
  // All references must outlive this object.
  RegionCue(const EdgeModel& model, const Camera& camera, const TrackerOptions& options,
            const std::vector<OutlinePlace>& places)
      : model_(model), camera_(camera), options_(options), places_(places) {}
  CueEquations linearise(const SE3& T_camera_model) override;

 private:
  const EdgeModel& model_;
  const Camera& camera_;
  const TrackerOptions& options_;
  const std::vector<OutlinePlace>& places_;
};

}  // namespace diorama
