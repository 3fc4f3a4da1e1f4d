#include "tracker/particle_filter.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace diorama {
namespace {

constexpr double kNothing = -std::numeric_limits<double>::infinity();

// log sum exp, safe where all terms are tiny.
double logSum(const std::vector<double>& logs) {
  const double largest = logs.empty() ? kNothing : *std::max_element(logs.begin(), logs.end());
  if (!std::isfinite(largest)) return kNothing;
  double sum = 0;
  for (const double value : logs) sum += std::exp(value - largest);
  return largest + std::log(sum);
}

// Weights that sum to 1 from logarithms with any offset; empty when all are zero.
std::vector<double> normalised(const std::vector<double>& logs) {
  const double sum = logSum(logs);
  if (!std::isfinite(sum)) return {};
  std::vector<double> weights;
  for (const double value : logs) weights.push_back(std::exp(value - sum));
  return weights;
}

}  // namespace

ParticleMean weightedMean(const std::vector<Particle>& particles) {
  ParticleMean mean;
  if (particles.empty()) return mean;
  mean.T = std::max_element(particles.begin(), particles.end(), [](const auto& a, const auto& b) {
             return a.weight < b.weight;
           })->T;
  constexpr int kIterations = 4;  // it converges quadratically
  for (int iteration = 0; iteration <= kIterations; ++iteration) {
    const SE3 inverse = mean.T.inverse();
    Vector6d step = Vector6d::Zero();
    double sum = 0;
    mean.covariance.setZero();
    for (const Particle& particle : particles) {
      const Vector6d xi = log(inverse * particle.T);
      step += particle.weight * xi;
      sum += particle.weight;
      mean.covariance += particle.weight * xi * xi.transpose();
    }
    if (!(sum > 0)) return mean;
    mean.covariance /= sum;
    if (iteration < kIterations) mean.T = mean.T * exp(step / sum);
  }
  return mean;
}

double effectiveCount(const std::vector<Particle>& particles) {
  double squares = 0;
  for (const Particle& particle : particles) squares += particle.weight * particle.weight;
  return squares > 0 ? 1 / squares : 0;
}

std::vector<size_t> systematicDraw(const std::vector<double>& weights, size_t count,
                                   double random) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<size_t> drawn;
  double sum = 0;
  size_t i = 0;
  for (size_t k = 0; k < count; ++k) {
    const double place = total * (static_cast<double>(k) + random) / static_cast<double>(count);
    while (i + 1 < weights.size() && sum + weights[i] <= place) sum += weights[i++];
    drawn.push_back(i);
  }
  return drawn;
}

ParticleFilter::ParticleFilter(const FilterOptions& options, int particles, uint64_t seed)
    : options_(options),
      count_(static_cast<size_t>(std::max(1, particles))),
      random_(seed, RandomStream::kParticles) {}

void ParticleFilter::start(const SE3& T) {
  particles_.assign(count_, {T, Vector6d::Zero(), 1 / static_cast<double>(count_)});
  before_.assign(count_, T);
  mean_ = {T, Matrix6d::Zero()};
}

Vector6d ParticleFilter::noise(uint32_t frame, uint64_t index, double sigma_m,
                               double sigma_rad) const {
  const auto a = random_.normal(frame, 2 * index), b = random_.normal(frame, 2 * index + 1);
  Vector6d xi;
  xi << sigma_m * Vector3d(a[0], a[1], a[2]), sigma_rad * Vector3d(b[0], b[1], b[2]);
  return xi;
}

void ParticleFilter::propagate(double seconds, uint32_t frame) {
  for (size_t i = 0; i < particles_.size(); ++i) {
    Particle& particle = particles_[i];
    before_[i] = particle.T;
    const double sigma = 2 * i < count_ ? options_.fine_sigma : options_.coarse_sigma;
    particle.T = particle.T * exp(options_.ar_factor * seconds * particle.motion) *
                 exp(noise(frame, i, sigma, sigma));
  }
}

void ParticleFilter::shift(const SE3& motion) {
  for (Particle& particle : particles_) particle.T = particle.T * motion;
}

// Of a sum of Gaussian kernels, up to a constant that is the same for all sets.
double ParticleFilter::logDensity(const SE3& T, const std::vector<SE3>& kernels,
                                  const std::vector<double>& weights) const {
  const SE3 inverse = T.inverse();
  std::vector<double> terms;
  for (size_t j = 0; j < kernels.size(); ++j) {
    const Vector6d xi = log(inverse * kernels[j]);
    terms.push_back(std::log(weights[j]) -
                    0.5 * (xi.head<3>() / options_.kernel_sigma_m).squaredNorm() -
                    0.5 * (xi.tail<3>() / options_.kernel_sigma_rad).squaredNorm());
  }
  return logSum(terms);
}

// The propagated states come from the density f of the dynamics, the refined ones from elsewhere.
// Taken together they are draws from the density g of the union, and the weight p(z|x) f(x) / g(x)
// makes draws of the posterior of them all.
bool ParticleFilter::update(const PoseJudge& judge, double seconds, uint32_t frame) {
  const size_t n = particles_.size();
  std::vector<SE3> states, propagated;
  std::vector<double> likelihood, prior;
  for (const Particle& particle : particles_) {
    const JudgedPose judged = judge(particle.T);
    propagated.push_back(particle.T);
    prior.push_back(particle.weight);
    states.insert(states.end(), {particle.T, judged.T_refined});
    likelihood.push_back(judged.log_likelihood.value_or(kNothing));
    likelihood.push_back(judged.refined_log_likelihood.value_or(kNothing));
  }
  const std::vector<double> even(2 * n, 0.5 / static_cast<double>(n));
  std::vector<double> logs(2 * n, kNothing);
  for (size_t k = 0; k < 2 * n; ++k)
    if (std::isfinite(likelihood[k]))
      logs[k] = likelihood[k] + logDensity(states[k], propagated, prior) -
                logDensity(states[k], states, even);
  const std::vector<double> weights = normalised(logs);
  if (weights.empty()) return false;

  std::vector<Particle> all(2 * n);
  for (size_t k = 0; k < 2 * n; ++k) {
    // The motion that really was, with what the image corrected.
    const Vector6d moved = log(before_[k / 2].inverse() * states[k]);
    const Vector6d motion = seconds > 0 ? Vector6d(moved / seconds) : Vector6d::Zero();
    all[k] = {states[k], motion, weights[k]};
  }
  mean_ = weightedMean(all);

  // Of each pair one stays, with the weight of both.
  const uint64_t past_noise = 4 * n;
  for (size_t i = 0; i < n; ++i) {
    const double pair = weights[2 * i] + weights[2 * i + 1];
    const double u = random_.uniform(frame, past_noise + i)[0];
    particles_[i] = all[2 * i + (u * pair >= weights[2 * i] ? 1 : 0)];
    particles_[i].weight = pair;
  }
  if (effectiveCount(particles_) <= options_.resample_below * static_cast<double>(n)) {
    const double u = random_.uniform(frame, past_noise + n)[0];
    const std::vector<size_t> drawn = systematicDraw(weights, n, u);
    for (size_t i = 0; i < n; ++i) {
      particles_[i] = all[drawn[i]];
      particles_[i].weight = 1 / static_cast<double>(n);
    }
  }
  return true;
}

std::vector<SE3> ParticleFilter::anneal(const SE3& start, const PoseJudge& judge,
                                        uint32_t frame) const {
  const size_t n = std::max(static_cast<size_t>(options_.start_particles), count_);
  std::vector<SE3> parents(n, start), refined;
  std::vector<double> likelihood;
  uint64_t index = 16 * n;  // past the draws of propagate() and update()
  for (int layer = 0; layer < options_.start_layers; ++layer) {
    const double narrower = std::ldexp(1.0, -layer);
    const double exponent = std::ldexp(1.0, layer + 1 - options_.start_layers);
    refined.clear();
    likelihood.clear();
    for (size_t i = 0; i < n; ++i) {
      Vector6d xi = noise(frame, index++, narrower * options_.start_sigma_m,
                          narrower * options_.start_sigma_rad);
      if (i == 0) xi.setZero();
      const JudgedPose judged = judge(parents[i] * exp(xi));
      refined.push_back(judged.T_refined);
      likelihood.push_back(judged.refined_log_likelihood.value_or(kNothing));
    }
    std::vector<double> logs;
    for (const double value : likelihood) logs.push_back(exponent * value);
    const std::vector<double> weights = normalised(logs);
    if (weights.empty()) return {};
    const auto drawn = systematicDraw(weights, n, random_.uniform(frame, 2 * index++)[0]);
    for (size_t i = 0; i < n; ++i) parents[i] = refined[drawn[i]];
  }
  return differentPoses(refined, likelihood);
}

std::vector<SE3> ParticleFilter::differentPoses(const std::vector<SE3>& poses,
                                                const std::vector<double>& likelihood) const {
  std::vector<size_t> order(poses.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return likelihood[a] > likelihood[b]; });
  std::vector<SE3> different;
  for (const size_t i : order) {
    if (!std::isfinite(likelihood[i])) break;
    const bool alike = std::any_of(different.begin(), different.end(), [&](const SE3& T) {
      const Vector6d xi = log(T.inverse() * poses[i]);
      return xi.head<3>().norm() < options_.kernel_sigma_m &&
             xi.tail<3>().norm() < options_.kernel_sigma_rad;
    });
    if (!alike) different.push_back(poses[i]);
  }
  return different;
}

}  // namespace diorama
