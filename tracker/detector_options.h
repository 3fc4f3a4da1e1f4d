// Options of the object detector.
#pragma once

#include "core/options.h"

namespace diorama {

struct DetectorOptions {
  // Features.
  int max_features = 1000;     // of an image
  double match_ratio = 0.85;   // Lowe 2004: 0.8; RANSAC copes with what is wrong
  double same_place = 0.04;    // nearer features are one place, in diameters of the object
  // Pose from matches: RANSAC (Fischler and Bolles 1981).
  std::string solver = "p3p";  // or epnp: of the minimal samples
  int samples = 600;
  double inlier_px = 5;
  int min_inliers = 8;
  double min_spread = 0.1;  // of the inliers on the object, in its diameters
  int hypotheses = 3;       // for each object, the next without the inliers of the last
  template <class V>
  void visit(V& v) {
    v("max_features", max_features, Range{1, 100000});
    v("match_ratio", match_ratio, kFraction);
    v("same_place", same_place, kFraction);
    v("solver", solver, {"p3p", "epnp"});
    v("samples", samples, Range{1, 1000000});
    v("inlier_px", inlier_px, kPositive);
    v("min_inliers", min_inliers, Range{4, 100000});
    v("min_spread", min_spread, kFraction);
    v("hypotheses", hypotheses, Range{1, 100});
  }
};

}  // namespace diorama
