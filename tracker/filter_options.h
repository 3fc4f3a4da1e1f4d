// Options of the particle filter on SE(3). What is named `paper` is of Singhal et al. 2017 and the
// programs it stands on (Choi and Christensen 2012).
#pragma once

#include "core/options.h"

namespace diorama {

struct FilterOptions {
  // Dynamics, first order and autoregressive (AR): X' = X exp(ar_factor * motion) exp(noise).
  double ar_factor = 0.5;  // paper; with 1 the particles' noise adds up in their motions
  // Noise of a frame, m and rad on each axis, for one half of the particles and for the other
  // (paper).
  double fine_sigma = 0.00015;
  double coarse_sigma = 0.0015;

  // Refinement of each particle: rounds of search, each with steps of its own.
  int rounds = 1;
  int search_px = 8;     // paper: 32
  int max_samples = 80;  // fewer than for the outcome: particles are many

  // Likelihood: exp(-lambda_edge * mean distance - lambda_valid * share of samples without an edge)
  // (paper).
  double lambda_edge = 0.5;  // 1/px
  double lambda_valid = 25;
  // Width of the kernels that stand for the density of a set of particles.
  double kernel_sigma_m = 0.005;
  double kernel_sigma_rad = 0.02;
  double resample_below = 0.5;  // effective share of the particles; paper: 1, every frame

  // Annealing at a (re)start, until the first good frame: layers of half the spread and twice the
  // exponent of the likelihood each.
  int start_particles = 20;  // never fewer than `particles`; 0 = no annealing
  int start_layers = 3;
  double start_sigma_m = 0.015;  // of the first layer, on each axis
  double start_sigma_rad = 0.06;
  int start_search_px = 16;
  int start_finalists = 3;  // different poses whose health is compared

  template <class V>
  void visit(V& v) {
    v("ar_factor", ar_factor, kFraction);
    v("fine_sigma", fine_sigma, kNotNegative);
    v("coarse_sigma", coarse_sigma, kNotNegative);
    v("rounds", rounds, Range{1, 10});
    v("search_px", search_px, Range{1, 32});
    v("max_samples", max_samples, Range{16, 10000});
    v("lambda_edge", lambda_edge, kNotNegative);
    v("lambda_valid", lambda_valid, kNotNegative);
    v("kernel_sigma_m", kernel_sigma_m, kPositive);
    v("kernel_sigma_rad", kernel_sigma_rad, kPositive);
    v("resample_below", resample_below, kFraction);
    v("start_particles", start_particles, Range{0, 1000});
    v("start_layers", start_layers, Range{1, 10});
    v("start_sigma_m", start_sigma_m, kNotNegative);
    v("start_sigma_rad", start_sigma_rad, kNotNegative);
    v("start_search_px", start_search_px, Range{1, 32});
    v("start_finalists", start_finalists, Range{1, 100});
  }
};

}  // namespace diorama
