// The depth filter: each new corner is a seed whose inverse depth is a Gaussian, with a Beta belief
// in its matches being right (Vogiatzis and Hernandez 2011, as in SVO). Its point is in the map
// from the start, with the covariance that it has (SVO 2, Forster et al. 2017); a seed that is
// certain is done, and its point is settled.
#pragma once

#include "vo/corners.h"
#include "vo/epipolar_search.h"

namespace diorama::vo {

struct Seed {
  Corner3d corner;
  MapPoint* point = nullptr;
  double mean = 1, variance = 1;  // of the inverse depth, 1/m
  double range = 1;               // of inverse depths that are possible at all
  double a = 10, b = 10;          // Beta: matches that were right and wrong
  int age = 0;                    // frames
  int last_searched = 0;          // frame count
};

// One match folded in. False, and nothing changed, when the result is not finite or not a depth.
bool updateSeed(Seed& seed, const InverseDepth& measured);

class DepthFilter {
 public:
  explicit DepthFilter(const VoOptions& options) : options_(options) {}

  // Seeds in the free cells of a new keyframe; depths as in `range`.
  void addSeeds(const Camera& camera, Keyframe& host, const DepthRange& range, Map& map);

  // Searches the seeds in a frame; the points of those that are certain now are settled, those of
  // seeds that are given up are bad.
  void update(const Camera& camera, const TrackedFrame& frame);

  void placePoints();          // where the hosts are now
  void forgetSettledPoints();  // that keyframes have seen: they are adjusted with the rest
  void removeHost(const Keyframe& host);
  void forgetBadPoints();       // before the map frees them
  void stretch(double factor);  // all depths
  const std::vector<Seed>& seeds() const { return seeds_; }

 private:
  void addSeed(const Camera& camera, Keyframe& host, const Corner& corner, bool edgelet,
               double guess, double range, Map& map);
  // Whether the seed is to be kept.
  bool updateOne(const Camera& camera, const TrackedFrame& frame, bool held, Seed& seed);

  VoOptions options_;
  std::vector<Seed> seeds_;
  int frames_ = 0;
};

}  // namespace diorama::vo
