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

// What the pixels along the normal of a sample say of the outline's place: the logarithm of a
// likelihood for each place between two of them, and the Gaussian nearest to it.
struct OutlineLikelihood {
  static constexpr int kReach = 8;  // px, on each side
  std::array<float, 2 * kReach + 2> values;
  int count = 0;  // of places, a pixel apart; the first one is half a pixel before inner_px
  float best = 0;
  SampleSides at;
  double mean_px = 0;      // from at.u_px outwards
  double information = 0;  // 1/px^2; 0 = the pixels tell nothing

  // Candidates whose place is less likely than the best by the factor exp(doubt) are not like
  // before.
  void doubt(double doubt, EdgeObservation& observation) const;
};

// Of all of them, each for the observation of its sample; both in the order of the samples.
void doubtEdges(const std::vector<OutlineLikelihood>& outline, double doubt,
                std::vector<EdgeObservation>& observations);

class OutlineColors {
 public:
  bool known() const { return known_; }
  // From a pose that is right; rates of the running means.
  void learn(const EdgePicture& picture, const std::vector<SampleSides>& outline, float inside_rate,
             float beside_rate);
  OutlineLikelihood compare(const EdgePicture& picture, const SampleSides& sample) const;
  // Whether most of the pixels of the object beside a sample have colours that were seen before.
  bool isFamiliar(const EdgePicture& picture, const SampleSides& sample) const;

 private:
  static constexpr int kLevels = 16, kColors = kLevels * kLevels * kLevels;
  static size_t colorAt(const EdgePicture& picture, const Vector2d& u_px);

  bool known_ = false;
  std::vector<float> inside_, beside_;  // shares of the colours
  std::vector<float> ratio_;            // logarithm of the first over the second
};

class RegionCue : public Cue {
 public:
  // All references must outlive this object.
  RegionCue(const EdgeModel& model, const Camera& camera, const TrackerOptions& options,
            const std::vector<OutlineLikelihood>& outline)
      : model_(model), camera_(camera), options_(options), outline_(outline) {}
  CueEquations linearise(const SE3& T_camera_model) override;

 private:
  const EdgeModel& model_;
  const Camera& camera_;
  const TrackerOptions& options_;
  const std::vector<OutlineLikelihood>& outline_;
};

}  // namespace diorama
