// A particle filter on SE(3) (after Choi and Christensen 2012; algorithms as in Singhal et al.
// 2017): autoregressive dynamics, particles that are refined by the image before they are weighted,
// with the correction that this needs, and annealing at a start. It knows nothing of edges: the
// image is behind a function that refines and judges a pose.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/random.h"
#include "core/se3.h"
#include "tracker/filter_options.h"

namespace diorama {

// What the image says about a pose and about the one that refinement makes of it. Nothing for the
// likelihood where nothing can be measured: such a pose is neither good nor bad.
struct JudgedPose {
  std::optional<double> log_likelihood;  // of the pose itself
  SE3 T_refined;
  std::optional<double> refined_log_likelihood;
};
using PoseJudge = std::function<JudgedPose(const SE3&)>;

struct Particle {
  SE3 T;                               // T_camera_model
  Vector6d motion = Vector6d::Zero();  // of the last frame, the correction included; 1/s
  double weight = 0;                   // they sum to 1
};

// The mean on the manifold, and the spread around it in the right tangent.
struct ParticleMean {
  SE3 T;
  Matrix6d covariance = Matrix6d::Zero();
};
ParticleMean weightedMean(const std::vector<Particle>& particles);

// 1 / sum w^2: so many particles carry the weight.
double effectiveCount(const std::vector<Particle>& particles);

// Indices of `count` draws in proportion to the weights, by one random number in [0, 1).
std::vector<size_t> systematicDraw(const std::vector<double>& weights, size_t count, double random);

class ParticleFilter {
 public:
  ParticleFilter(const FilterOptions& options, int particles, uint64_t seed);

  bool started() const { return !particles_.empty(); }
  void stop() { particles_.clear(); }
  void start(const SE3& T);  // all particles there, at rest

  // Moves every particle by its motion and by noise.
  void propagate(double seconds, uint32_t frame);
  // Moves all of them alike, as seen from the model.
  void shift(const SE3& motion);
  // Refines and weighs; false when no particle could be measured: then nothing has changed.
  bool update(const PoseJudge& judge, double seconds, uint32_t frame);

  // Of the last update, before it resampled.
  const ParticleMean& mean() const { return mean_; }
  const std::vector<Particle>& particles() const { return particles_; }

  // Poses around `start` that agree with the image, the likeliest first, no two of them alike. The
  // particles of this filter are left alone.
  std::vector<SE3> anneal(const SE3& start, const PoseJudge& judge, uint32_t frame) const;

 private:
  Vector6d noise(uint32_t frame, uint64_t index, double sigma_m, double sigma_rad) const;
  double logDensity(const SE3& T, const std::vector<SE3>& kernels,
                    const std::vector<double>& weights) const;
  std::vector<SE3> differentPoses(const std::vector<SE3>& poses,
                                  const std::vector<double>& likelihood) const;

  FilterOptions options_;
  size_t count_;
  Random random_;
  std::vector<Particle> particles_;
  std::vector<SE3> before_;  // where each particle was in the last frame
  ParticleMean mean_;
};

}  // namespace diorama
