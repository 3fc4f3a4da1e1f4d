#include "tracker/particle_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>

namespace diorama {
namespace {

SE3 at(double x, double y = 0, double z = 0.5) {
  return {Eigen::Quaterniond::Identity(), Vector3d(x, y, z)};
}

// Refines a part of the way to the truth; the likelihood is normal about it.
PoseJudge pullTo(const SE3& truth, double share, double sigma = 0.005) {
  const auto likelihood = [=](const SE3& T) {
    const Vector6d xi = log(T.inverse() * truth);
    return -0.5 * xi.squaredNorm() / (sigma * sigma);
  };
  return [=](const SE3& T) {
    const SE3 refined = T * exp(share * log(T.inverse() * truth));
    return JudgedPose{likelihood(T), refined, likelihood(refined)};
  };
}

double sumOfWeights(const ParticleFilter& filter) {
  return std::accumulate(filter.particles().begin(), filter.particles().end(), 0.0,
                         [](double sum, const Particle& p) { return sum + p.weight; });
}

constexpr double kFrame_s = 1.0 / 30;

TEST(WeightedMean, WeighsOnTheManifold) {
  const SE3 centre{expSO3(Vector3d(3.0, 0.4, -0.2)), Vector3d(0.1, 0.2, 0.6)};
  Vector6d xi;
  xi << 0.03, -0.01, 0.02, 0.2, 0.1, -0.3;
  const std::vector<Particle> particles{{centre * exp(xi), Vector6d::Zero(), 0.25},
                                        {centre * exp(Vector6d(-xi / 3)), Vector6d::Zero(), 0.75}};
  const ParticleMean mean = weightedMean(particles);
  EXPECT_LT(log(mean.T.inverse() * centre).norm(), 1e-9);
  EXPECT_LT((mean.covariance - xi * xi.transpose() / 3).norm(), 1e-9);
}

TEST(WeightedMean, OfNothingIsFinite) { EXPECT_TRUE(weightedMean({}).T.isFinite()); }

TEST(SystematicDraw, IsInProportion) {
  const std::vector<double> weights{0.1, 0.0, 0.6, 0.3};
  std::vector<int> counts(4, 0);
  for (const size_t i : systematicDraw(weights, 1000, 0.5)) ++counts[i];
  EXPECT_EQ(counts, (std::vector<int>{100, 0, 600, 300}));
  EXPECT_EQ(systematicDraw({0, 0, 1}, 3, 0.999999), (std::vector<size_t>{2, 2, 2}));
}

TEST(ParticleFilter, ConvergesOnAStillObject) {
  ParticleFilter filter({}, 20, 1);
  const SE3 truth = at(0.004, -0.002);
  filter.start(at(0));
  for (uint32_t frame = 0; frame < 10; ++frame) {
    filter.propagate(kFrame_s, frame);
    ASSERT_TRUE(filter.update(pullTo(truth, 0.7), kFrame_s, frame));
    EXPECT_NEAR(sumOfWeights(filter), 1, 1e-9);
  }
  EXPECT_LT(log(filter.mean().T.inverse() * truth).norm(), 0.001);
}

// The original took the motion of the particle before its correction: then an object that is only
// ever moved by corrections has no motion at all, and every prediction is a frame late.
TEST(ParticleFilter, MotionIsOfTheCorrectedPose) {
  FilterOptions options;
  options.fine_sigma = options.coarse_sigma = 1e-5;
  options.ar_factor = 1;
  ParticleFilter filter(options, 20, 1);
  filter.start(at(0));
  constexpr double kStep = 0.004;
  for (uint32_t frame = 1; frame < 8; ++frame) {
    filter.propagate(kFrame_s, frame);
    if (frame > 2) {
      EXPECT_NEAR(weightedMean(filter.particles()).T.translation.x(), kStep * frame, 0.1 * kStep);
    }
    ASSERT_TRUE(filter.update(pullTo(at(kStep * frame), 1, 0.0005), kFrame_s, frame));
  }
}

TEST(ParticleFilter, MotionIsDampedAndScalesWithTime) {
  FilterOptions options;
  options.fine_sigma = options.coarse_sigma = 0;
  options.ar_factor = 0.5;
  ParticleFilter filter(options, 4, 1);
  filter.start(at(0));
  filter.propagate(kFrame_s, 1);
  ASSERT_TRUE(filter.update(pullTo(at(0.003), 1, 0.0003), kFrame_s, 1));
  const double x = filter.particles()[0].T.translation.x();
  filter.propagate(2 * kFrame_s, 2);
  EXPECT_NEAR(filter.particles()[0].T.translation.x(), x + 0.5 * 2 * 0.003, 1e-6);
}

// The original's covariance had a floor of 0.1, which hid the real one.
TEST(ParticleFilter, SpreadHasNoFloor) {
  ParticleFilter filter({}, 50, 1);
  filter.start(at(0));
  for (uint32_t frame = 0; frame < 5; ++frame) {
    filter.propagate(kFrame_s, frame);
    ASSERT_TRUE(filter.update(pullTo(at(0), 0.9, 0.0003), kFrame_s, frame));
  }
  EXPECT_LT(std::sqrt(filter.mean().covariance.trace()), 0.002);
}

// A particle that saw nothing kept its old weight in the original, which then was the largest of
// all. Here it has none; and where nothing is seen at all, nothing changes.
TEST(ParticleFilter, ParticlesWithoutMeasurementHaveNoSay) {
  FilterOptions options;
  options.resample_below = 0;
  ParticleFilter filter(options, 10, 1);
  filter.start(at(0));
  filter.propagate(kFrame_s, 0);
  const double middle = filter.particles()[5].T.translation.x();
  const auto half_blind = [&](const SE3& T) {
    JudgedPose judged{std::nullopt, T, std::nullopt};
    if (T.translation.x() >= middle) judged.log_likelihood = judged.refined_log_likelihood = -1000;
    return judged;
  };
  ASSERT_TRUE(filter.update(half_blind, kFrame_s, 0));
  for (const Particle& particle : filter.particles())
    if (particle.T.translation.x() < middle) {
      EXPECT_EQ(particle.weight, 0);
    }
  EXPECT_NEAR(sumOfWeights(filter), 1, 1e-9);

  const std::vector<Particle> before = filter.particles();
  const auto blind = [](const SE3& T) { return JudgedPose{std::nullopt, T, std::nullopt}; };
  EXPECT_FALSE(filter.update(blind, kFrame_s, 1));
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(filter.particles()[i].weight, before[i].weight);
    EXPECT_EQ(filter.particles()[i].T.matrix(), before[i].T.matrix());
  }
}

// The original scored the pose from before the refinement: then refined states would weigh no more
// than the ones that they came from.
TEST(ParticleFilter, RefinedPosesAreWeighedByTheirOwnLikelihood) {
  FilterOptions options;
  options.fine_sigma = options.coarse_sigma = 0.0001;
  ParticleFilter filter(options, 20, 1);
  filter.start(at(0));
  filter.propagate(kFrame_s, 0);
  ASSERT_TRUE(filter.update(pullTo(at(0.01), 1, 0.002), kFrame_s, 0));
  EXPECT_NEAR(filter.mean().T.translation.x(), 0.01, 0.001);
}

// The original averaged the resampled states, all alike: here the mean is that of the weights.
TEST(ParticleFilter, MeanIsWeightedAlsoWhereItResamples) {
  FilterOptions options;
  options.resample_below = 1;
  options.coarse_sigma = options.fine_sigma = 0.004;
  ParticleFilter filter(options, 200, 1);
  filter.start(at(0));
  filter.propagate(kFrame_s, 0);
  // Without refinement: the posterior of N(0, 4 mm) and a likelihood N(4 mm, 4 mm).
  ASSERT_TRUE(filter.update(pullTo(at(0.004), 0, 0.004), kFrame_s, 0));
  EXPECT_NEAR(filter.mean().T.translation.x(), 0.002, 0.0006);
  for (const Particle& particle : filter.particles()) EXPECT_NEAR(particle.weight, 0.005, 1e-12);
}

// What refinement moves is no draw from the dynamics any more. With the correction the outcome is
// the posterior: without it, particles pulled to the likelihood's peak would count twice.
TEST(ParticleFilter, RefinementDoesNotBiasThePosterior) {
  FilterOptions options;
  options.coarse_sigma = options.fine_sigma = 0.004;
  options.kernel_sigma_m = options.kernel_sigma_rad = 0.001;
  const auto judge = [](const SE3& T) {
    // One dimension only, so that few particles cover it.
    const auto likelihood = [](const SE3& pose) {
      return -0.5 * std::pow((pose.translation.x() - 0.004) / 0.004, 2);
    };
    SE3 refined = T;
    refined.translation.x() += 0.5 * (0.004 - T.translation.x());
    return JudgedPose{likelihood(T), refined, likelihood(refined)};
  };
  double sum = 0;
  constexpr int kRuns = 20;
  for (int run = 0; run < kRuns; ++run) {
    ParticleFilter filter(options, 200, static_cast<uint64_t>(run));
    filter.start(at(0));
    filter.propagate(kFrame_s, 0);
    ASSERT_TRUE(filter.update(judge, kFrame_s, 0));
    sum += filter.mean().T.translation.x();
  }
  EXPECT_NEAR(sum / kRuns, 0.002, 0.0004);
}

TEST(ParticleFilter, ResamplesOnlyWhenFewParticlesCarryTheWeight) {
  ParticleFilter filter({}, 20, 1);
  filter.start(at(0));
  filter.propagate(kFrame_s, 0);
  ASSERT_TRUE(filter.update(pullTo(at(0), 0, 1), kFrame_s, 0));  // says next to nothing
  EXPECT_NE(filter.particles()[0].weight, 0.05);
  filter.propagate(kFrame_s, 1);
  ASSERT_TRUE(filter.update(pullTo(at(0.003), 0, 0.0003), kFrame_s, 1));  // prefers one
  EXPECT_EQ(filter.particles()[0].weight, 0.05);
}

TEST(ParticleFilter, AnnealingFindsTheBetterOfTwoValleys) {
  FilterOptions options;
  const SE3 truth = at(0.02, 0.01), decoy = at(-0.008);
  const auto judge = [&](const SE3& T) {
    const bool left = log(T.inverse() * decoy).norm() < log(T.inverse() * truth).norm();
    JudgedPose judged = pullTo(left ? decoy : truth, 0.8, 0.01)(T);
    if (left) *judged.log_likelihood -= 4, *judged.refined_log_likelihood -= 4;
    return judged;
  };
  const ParticleFilter filter(options, 1, 1);
  const std::vector<SE3> found = filter.anneal(at(0), judge, 0);
  ASSERT_FALSE(found.empty());
  EXPECT_LT(log(found[0].inverse() * truth).norm(), 0.006);
  for (size_t i = 0; i < found.size(); ++i)
    for (size_t j = 0; j < i; ++j) EXPECT_GT(log(found[i].inverse() * found[j]).norm(), 0.004);
}

TEST(ParticleFilter, AnnealingWhereNothingIsSeenFindsNothing) {
  const ParticleFilter filter({}, 1, 1);
  const auto blind = [](const SE3& T) { return JudgedPose{std::nullopt, T, std::nullopt}; };
  EXPECT_TRUE(filter.anneal(at(0), blind, 0).empty());
}

TEST(ParticleFilter, SameSeedSameParticles) {
  ParticleFilter a({}, 20, 7), b({}, 20, 7), other({}, 20, 8);
  for (ParticleFilter* filter : {&a, &b, &other}) {
    filter->start(at(0));
    filter->propagate(kFrame_s, 3);
    ASSERT_TRUE(filter->update(pullTo(at(0.001), 0.5), kFrame_s, 3));
  }
  bool differs = false;
  for (size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(a.particles()[i].T.matrix(), b.particles()[i].T.matrix());
    differs |= a.particles()[i].T.matrix() != other.particles()[i].T.matrix();
  }
  EXPECT_TRUE(differs);
}

}  // namespace
}  // namespace diorama
