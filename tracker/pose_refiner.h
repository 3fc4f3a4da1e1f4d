// Makes a pose agree with an image: rounds of search along the edges and robust Gauss-Newton with
// the texture patches, and what the image says about the result.
#pragma once

#include <optional>
#include <vector>

#include "core/measurements.h"
#include "core/ray_query.h"
#include "tracker/edge_model.h"
#include "tracker/edge_search.h"
#include "tracker/health.h"
#include "tracker/image_pyramid.h"
#include "tracker/motion_filter.h"
#include "tracker/particle_filter.h"
#include "tracker/pose_solver.h"
#include "tracker/print.h"
#include "tracker/sample_selection.h"
#include "tracker/texture_cue.h"

namespace diorama {

// A pose with everything that was found out about it.
struct Estimate {
  SE3 T_camera_model;
  Matrix6d covariance = Matrix6d::Identity();
  // The part of the covariance that neighbouring frames do not share.
  Matrix6d own_covariance = Matrix6d::Identity();
  Matrix6d by_image = Matrix6d::Zero();  // information of all cues but a prior
  bool by_prediction = false;            // a prior was among the cues
  CueEquations edges;
  CueEquations given_keyframe;  // of the texture, were its keyframe's pose exact
  std::vector<int> samples;     // of the model, that were looked for
  std::vector<EdgeObservation> observations;
  TrackHealth health;
  // How sharply the edges agree, in [0, 1]: what tells the right one of two poses that both look
  // healthy. Its level depends on blur and model: to compare poses in one image only.
  double fit = 0;
  double print_sigma_px = 0;  // of the print's patches; 0 = too few were found

  // Of two estimates in one image: by the print where it makes a difference, else by the edges.
  bool isSharperThan(const Estimate& other) const;
};

// What is known of a start independently of the images, in the model frame; nothing of others.
std::optional<PosePrior> independentPrior(const ObjectPrediction& start, const EdgeModel& model);

class PoseRefiner {
 public:
  // All references must outlive this object.
  PoseRefiner(const EdgeModel& model, const Mesh& mesh, const Camera& camera, const RayQuery& rays,
              int object, const TrackerOptions& options);

  // The image that the calls below are about; must outlive them.
  void setImage(const EdgePicture& picture, Covers covers) {
    picture_ = picture;
    selection_.setImage(picture, covers);
  }

  // Only the object's edges in this part of the image are looked for.
  void setPart(const ImagePart& part) { selection_.setPart(part); }

  // What is known of the pose beside the images, as long as it is followed from where that was so:
  // information, right tangent. Errors that the edges share weigh the less where it is much.
  void setKnown(const Matrix6d& information) { known_ = information; }

  // One round of search for each range, from wide to narrow.
  Estimate refine(const SE3& start, const std::vector<int>& search_ranges_px,
                  const std::optional<PosePrior>& prior = std::nullopt);
  Estimate refine(const SE3& start, const std::optional<PosePrior>& prior = std::nullopt) {
    return refine(start, usualRanges(), prior);
  }

  // Where the picture is smeared by the motion since T_before, the pose of the last frame.
  Estimate refineSmeared(const SE3& start, const SE3& T_before,
                         const std::optional<PosePrior>& prior);

  // A given start may be off by a hair or by many pixels, where a wide search finds too much: the
  // ranges that lead to the best agreement are right.
  Estimate refineStart(const SE3& start, const std::optional<PosePrior>& prior = std::nullopt);

  // Round things have poses side by side that look nearly alike, centimetres apart. From a pose,
  // steps along the principal directions of what its edges know, each refined: goes to the
  // likeliest by its fit and the prior, as long as there is a better one. Those about as likely add
  // to the covariance.
  Estimate searchNeighbours(Estimate estimate,
                            const std::optional<PosePrior>& prior = std::nullopt);

  // The cheap version of refine() for the many poses of a particle filter: edges alone, at the
  // given samples, and how likely the pose is before and after.
  JudgedPose judge(const SE3& start, const std::vector<int>& samples,
                   const std::vector<int>& search_ranges_px) const;
  std::vector<int> visibleSamples(const SE3& T_camera_model, int max_samples);

  // Where something covers the object, seen from about this pose; nowhere unless it is left out.
  const CoverMap& coverAt(const SE3& T_camera_model) { return selection_.coverAt(T_camera_model); }

  // The share of visible samples with an edge nearby.
  double edgeScore(const SE3& T_camera_model);

  // Learns from a good estimate: the contrast of the edges, and new patches where they are needed.
  void remember(const Estimate& estimate);

  // About how far the projection moves between two poses, px.
  double pixelMotion(const SE3& a, const SE3& b) const {
    return diorama::pixelMotion(model_, camera_, a, b);
  }

 private:
  std::vector<int> usualRanges() const {
    return {options_.wide_search_px, options_.narrow_search_px};
  }
  SolverLimits solverLimits() const;
  Matrix6d motionWithin(double range_px, const SE3& T_camera_model,
                        const std::vector<int>& samples) const;
  void seePrint(const SE3& T_camera_model);
  void alignPatches(const SE3& T_camera_model);
  void setCovariance(const PoseSolution& solution, const std::optional<PosePrior>& prior,
                     Estimate& estimate) const;
  VisibleSamples countSamples(const SampleSelection::Samples& samples,
                              const SE3& T_camera_model) const;
  double fitOf(const VisibleSamples& visible,
               const std::vector<EdgeObservation>& observations) const;
  std::vector<SE3> neighboursOf(const Estimate& estimate) const;
  double edgeMotion(const std::vector<EdgeObservation>& observations, const SE3& T) const;
  std::optional<double> logLikelihood(size_t visible_samples,
                                      const std::vector<EdgeObservation>& observations) const;
  void learnContrast(const std::vector<EdgeObservation>& observations);

  const EdgeModel& model_;
  const Camera& camera_;
  const TrackerOptions& options_;
  const EdgeSearch search_;
  SampleSelection selection_;
  TextureCue texture_;
  const Print print_;
  TextureCue printed_;
  std::vector<Contrast> memory_;  // one per sample of the model
  Matrix6d known_ = Matrix6d::Zero();
  std::optional<EdgePicture> picture_;
  std::optional<SE3> T_before_;  // while edges are taken for smeared
};

}  // namespace diorama
