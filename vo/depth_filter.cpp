#include "vo/depth_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "vo/corners.h"
#include "vo/edgelets.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr double kSearchSigmas = 2;           // about the mean
constexpr double kSmallestParallax = 2.6e-3;  // rad (0.15 degrees): less says nothing of depth
constexpr double kWorstInlierShare = 0.15;    // a / (a + b) below it: the corner is no point
constexpr double kFarthestM = 30;             // searches begin at most this far
// (SVO) the nearest depth possible is half of the nearest seen; six sigmas cover the range.
constexpr double kNearerThanSeen = 0.5, kSigmasInRange = 6;

double normalDensity(double x, double mean, double variance) {
  const double d = x - mean;
  return std::exp(-0.5 * d * d / variance) / std::sqrt(2 * std::numbers::pi * variance);
}

// p = T b / rho, d p / d rho = -R b / rho^2.
void placePoint(const Seed& seed) {
  const SE3& T_world_host = seed.corner.host->T_world_camera;
  seed.point->p_world = T_world_host * Vector3d(seed.corner.bearing / seed.mean);
  const Vector3d along = T_world_host.rotation * seed.corner.bearing;
  const double sigma = std::sqrt(seed.variance) / (seed.mean * seed.mean);
  seed.point->covariance = sigma * sigma * along * along.transpose();
}

// Assumptions are wrong together: many of them must not make a strong one.
void assumeDepth(const Seed& seed) {
  constexpr double kAssumedSigma = 10;
  MapPoint& point = *seed.point;
  const Vector3d along = seed.corner.host->T_world_camera.rotation * seed.corner.bearing;
  const double sigma = kAssumedSigma * std::sqrt(seed.variance) / (seed.mean * seed.mean);
  point.assumed_p_world = point.p_world;
  point.assumed_information =
      along * along.transpose() / (sigma * sigma * std::pow(along.squaredNorm(), 2));
}

// What is near in the image is often near in space.
class DepthGuess {
 public:
  DepthGuess(const TrackedFrame& frame, double otherwise) : otherwise_(otherwise) {
    const SE3 T_camera_world = frame.T_world_camera.inverse();
    for (const Feature& feature : frame.features)
      if (const double z = (T_camera_world * feature.point->p_world).z();
          feature.point->settled && z > 0)
        known_.push_back({feature.u_px, 1 / z});
  }

  // Inverse depth: the middle one of the three nearest features'.
  double at(const Vector2d& u_px) {
    if (known_.size() < 3) return otherwise_;
    const auto distance2 = [&](const Known& known) { return (known.u_px - u_px).squaredNorm(); };
    const auto third = known_.begin() + 3;
    std::partial_sort(known_.begin(), third, known_.end(),
                      [&](const Known& a, const Known& b) { return distance2(a) < distance2(b); });
    std::array depths{known_[0].inverse_depth, known_[1].inverse_depth, known_[2].inverse_depth};
    std::sort(depths.begin(), depths.end());
    return depths[1];
  }

 private:
  struct Known {
    Vector2d u_px;
    double inverse_depth;
  };
  std::vector<Known> known_;
  double otherwise_;
};

}  // namespace

// Vogiatzis and Hernandez, supplementary material: moments of the product of the posterior and the
// mixture of a Gaussian inlier and a uniform outlier.
bool updateSeed(Seed& seed, const InverseDepth& measured) {
  const double tau2 = measured.sigma * measured.sigma;
  const double s2 = 1 / (1 / seed.variance + 1 / tau2);
  const double m = s2 * (seed.mean / seed.variance + measured.value / tau2);
  const double a = seed.a, b = seed.b, n = a + b;
  double c1 = a / n * normalDensity(measured.value, seed.mean, seed.variance + tau2);
  double c2 = b / n / seed.range;
  const double sum = c1 + c2;
  c1 /= sum;
  c2 /= sum;
  const double first = c1 * (a + 1) / (n + 1) + c2 * a / (n + 1);
  const double second =
      c1 * (a + 1) * (a + 2) / ((n + 1) * (n + 2)) + c2 * a * (a + 1) / ((n + 1) * (n + 2));
  const double mean = c1 * m + c2 * seed.mean;
  const double variance =
      c1 * (s2 + m * m) + c2 * (seed.variance + seed.mean * seed.mean) - mean * mean;
  const double new_a = (second - first) / (first - second / first);
  const double new_b = new_a * (1 - first) / first;
  if (!std::isfinite(mean + variance + new_a + new_b) || !(variance > 0) || !(mean > 0))
    return false;
  seed.mean = mean;
  seed.variance = variance;
  seed.a = new_a;
  seed.b = new_b;
  return true;
}

void DepthFilter::addSeeds(const Camera& camera, Keyframe& host, const DepthRange& range,
                           Map& map) {
  DepthGuess guess(host, 1 / range.median_m);
  const double largest = 1 / (kNearerThanSeen * range.nearest_m);
  const CellGrid grid(camera.width(), camera.height(), options_.cell_px);
  std::vector<uint8_t> occupied(grid.size(), 0);
  for (const Feature& feature : host.features) occupied[grid.cellOf(feature.u_px)] = 1;
  const int room = options_.max_features - static_cast<int>(host.features.size());
  constexpr int kFewest = 20;  // new ones in each keyframe: old points will be left behind
  const int count = std::max(room, kFewest);
  const auto add = [&](const std::vector<Corner>& corners, bool edgelets) {
    for (const Corner& corner : corners) {
      occupied[grid.cellOf(corner.u_px)] = 1;
      if (host.isOpen(corner.u_px, corner.level))
        addSeed(camera, host, corner, edgelets, guess.at(corner.u_px), largest, map);
    }
  };
  add(detectCorners(*host.pyramid, host.noise, grid, occupied, count, options_,
                    host.blurred_levels),
      false);
  const int few = options_.edgelets_below - static_cast<int>(host.features.size());
  if (few > 0)
    add(detectEdgelets(*host.pyramid, host.noise, grid, occupied, few, options_,
                       host.blurred_levels),
        true);
  // The oldest had their chance.
  const int surplus = static_cast<int>(seeds_.size()) - options_.max_seeds;
  for (int i = 0; i < surplus; ++i) seeds_[static_cast<size_t>(i)].point->bad = true;
  if (surplus > 0) seeds_.erase(seeds_.begin(), seeds_.begin() + surplus);
}

// `guess`: of the inverse depth; `range`: of those that are possible.
void DepthFilter::addSeed(const Camera& camera, Keyframe& host, const Corner& corner, bool edgelet,
                          double guess, double range, Map& map) {
  const auto bearing = camera.unproject(corner.u_px);
  if (!bearing) return;
  Seed seed;
  seed.corner = {&host, corner.u_px, *bearing, corner.level, edgelet};
  seed.mean = guess;
  seed.range = range;
  const double sigma = seed.range / kSigmasInRange;
  seed.variance = sigma * sigma;
  seed.point =
      &map.addPoint(host, Vector3d::Zero(), hostMeasurement(corner.u_px, corner.level, options_));
  seed.point->settled = false;
  seed.point->edgelet = edgelet;
  placePoint(seed);
  assumeDepth(seed);
  seeds_.push_back(seed);
}

bool DepthFilter::updateOne(const Camera& camera, const TrackedFrame& frame, bool held,
                            Seed& seed) {
  if (seed.point->bad) return false;
  const SE3 T_frame_host = frame.T_world_camera.inverse() * seed.corner.host->T_world_camera;
  const Vector3d p_frame = T_frame_host * Vector3d(seed.corner.bearing / seed.mean);
  const Vector3d ray = T_frame_host.rotation * seed.corner.bearing;
  const double cosine = p_frame.normalized().dot(ray.normalized());
  if (!(cosine < std::cos(kSmallestParallax))) return true;
  const auto u_px = camera.project(p_frame);
  if (u_px && frame.moving.contains(*u_px, seed.corner.level)) return true;
  const double reach = kSearchSigmas * std::sqrt(seed.variance);
  const EpipolarMatch match =
      searchEpipolar(camera, seed.corner, frame, std::max(1 / kFarthestM, seed.mean - reach),
                     seed.mean + reach, options_);
  if (match.outcome == EpipolarOutcome::kNotVisible) return true;
  if (match.outcome == EpipolarOutcome::kNoMatch)
    seed.b += 1;
  else if (!updateSeed(seed, match.depth))
    return true;
  placePoint(seed);
  if (seed.a / (seed.a + seed.b) < kWorstInlierShare) return false;
  if (!held || std::sqrt(seed.variance) > options_.seed_converged * seed.mean) return true;
  settle(frame, *seed.point);
  return false;
}

void DepthFilter::update(const Camera& camera, const TrackedFrame& frame) {
  ++frames_;
  // Depths are as good as the poses that they are seen from.
  const bool held = certainFeatures(frame) >= options_.unsettled_below;
  // Those that have waited longest are searched first.
  std::vector<size_t> order;
  for (size_t i = 0; i < seeds_.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](size_t x, size_t y) {
    return seeds_[x].last_searched < seeds_[y].last_searched;
  });
  order.resize(std::min(order.size(), static_cast<size_t>(options_.max_seed_searches)));
  std::vector<uint8_t> done(seeds_.size(), 0);
  for (const size_t i : order) {
    seeds_[i].last_searched = frames_;
    done[i] = !updateOne(camera, frame, held, seeds_[i]);
  }
  size_t kept = 0;
  for (size_t i = 0; i < seeds_.size(); ++i) {
    if (!done[i] && ++seeds_[i].age <= options_.max_seed_age)
      seeds_[kept++] = seeds_[i];
    else if (!seeds_[i].point->settled)
      seeds_[i].point->bad = true;
  }
  seeds_.resize(kept);
}

void DepthFilter::forgetSettledPoints() {
  std::erase_if(seeds_, [](const Seed& seed) { return seed.point->settled; });
}

void DepthFilter::placePoints() {
  for (const Seed& seed : seeds_) placePoint(seed);
}

void DepthFilter::stretch(double factor) {
  for (Seed& seed : seeds_) {
    seed.mean /= factor;
    seed.variance /= factor * factor;
    seed.range /= factor;
  }
}

void DepthFilter::removeHost(const Keyframe& host) {
  std::erase_if(seeds_, [&](const Seed& seed) { return seed.corner.host == &host; });
}

void DepthFilter::forgetBadPoints() {
  std::erase_if(seeds_, [](const Seed& seed) { return seed.point->bad; });
}

}  // namespace diorama::vo
