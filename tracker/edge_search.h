// Finds the edges of the model in the image: visible samples of a pose, and candidates for each
// along its projected normal.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/ray_query.h"
#include "tracker/edge_model.h"
#include "tracker/edge_profile.h"
#include "tracker/pose_solver.h"

namespace diorama {

struct EdgeObservation {
  static constexpr int kMaxCandidates = 3;
  int sample = 0;
  bool contour = false;  // on the outline, or on an open rim; otherwise a crease inside
  Vector2d u_px;         // where the sample projected when the search was made
  Vector2d normal;       // unit, of the projected edge
  int step_px = 1;       // of the profile: more where motion has smeared the edge
  int candidate_count = 0;
  std::array<EdgeCandidate, kMaxCandidates> candidates;  // the strongest
  int chosen = -1;                                       // by EdgeCue; -1 = none
  double residual_px = 0;
};

// What lies on both sides of a sample's edge.
struct SampleSides {
  int sample = 0;
  Vector2d u_px;         // where it projects,
  Vector2d outwards;     // unit: to the side that is not the object, where one is
  bool outline = false;  // one is: the object ends here; else both sides are the object
  int inner_px = 0;      // at least so far either side goes on
  int outer_px = 0;
};

class EdgeSearch {
 public:
  // All references must outlive this object.
  EdgeSearch(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
             const TrackerOptions& options);

  // Samples that project into the image and are not hidden by the object itself, at most
  // max_samples (of the options), about sample_step_px (or sample_step_m) apart.
  std::vector<int> visibleSamples(const SE3& T_camera_model, int max_samples) const;
  std::vector<int> visibleSamples(const SE3& T_camera_model) const {
    return visibleSamples(T_camera_model, options_.max_samples);
  }

  // Whether a sample is on the outline or on an open rim, seen from `eye` in the model frame.
  bool onContour(int sample, const Vector3d& eye) const {
    return onContour(
        model_.edges[static_cast<size_t>(model_.samples[static_cast<size_t>(sample)].edge)], eye);
  }

  // A sample on its projected edge.
  struct Line {
    Vector2d u_px;
    Vector2d normal;  // unit, of the projected edge
  };
  // Nothing where the edge is seen end-on, or the sample is not in front of the camera.
  std::optional<Line> projectSample(const SE3& T_camera_model, const Matrix3d& R, int sample) const;

  // Candidates of the given samples within range_px. memory[sample] is the remembered contrast.
  // Samples without a candidate are left out. With the pose of the frame before, edges that have
  // moved far across are looked for as if the shutter had been open all the while.
  std::vector<EdgeObservation> search(const EdgePicture& picture, const SE3& T_camera_model,
                                      const std::vector<int>& samples,
                                      const std::vector<Contrast>& memory, int range_px,
                                      const std::optional<SE3>& T_before = std::nullopt) const;

  // The sides of samples near which the object is to be seen; only of those on its outline when
  // `outline_only`. Asked about near_px and far_px away from the edge.
  std::vector<SampleSides> sidesOf(const SE3& T_camera_model, const std::vector<int>& samples,
                                   int near_px, int far_px, bool outline_only) const;

 private:
  bool onContour(const ModelEdge& edge, const Vector3d& eye) const;
  std::vector<int> samplesInImage(const SE3& T_camera_model, const Vector3d& eye) const;

  bool observe(const EdgePicture& picture, const Line& line, int range_px,
               EdgeObservation& out) const;
  int smearStep(const SE3& T_before, int sample, const Line& line) const;
  void compareContrast(const std::vector<Contrast>& memory,
                       std::vector<EdgeObservation>& observations) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const RayQuery& rays_;
  int object_;
  const TrackerOptions& options_;
};

// Rims, shadows and highlights displace a whole side of an outline alike.
class SideErrors {
 public:
  SideErrors(const Camera& camera, const SE3& T_camera_model);
  // Of a residual along a unit normal at u_px: weight times its Jacobian.
  void add(const Vector2d& normal, const Vector2d& u_px, const Vector6d& weighted_jacobian);
  // Covariance of the gradient, where each side is displaced by so much.
  Matrix6d shared(double offset_px) const;

 private:
  static constexpr size_t kSides = 16;
  Vector2d middle_px_;
  std::array<Vector6d, kSides> gradients_;
};

// Distances of projected samples to their best candidates: r = n . (u(T) - u_found).
class EdgeCue : public Cue {
 public:
  EdgeCue(const EdgeModel& model, const Camera& camera, const TrackerOptions& options,
          std::vector<EdgeObservation>& observations, double smallest_sigma_px)
      : model_(model),
        camera_(camera),
        options_(options),
        observations_(observations),
        smallest_sigma_px_(smallest_sigma_px) {}

  // Chooses each observation's candidate anew, and leaves its residual there.
  CueEquations linearise(const SE3& T_camera_model) override;

 private:
  const EdgeModel& model_;
  const Camera& camera_;
  const TrackerOptions& options_;
  std::vector<EdgeObservation>& observations_;
  double smallest_sigma_px_;
  std::vector<double> absolute_;
};

}  // namespace diorama
