// Options of the object detector.
#pragma once

#include "core/options.h"

namespace diorama {

// The image's edges, by direction.
struct ChamferOptions {
  double canny_low = 20;         // gradients of a slightly blurred image, Sobel's units
  double canny_high = 50;        // ... at which an edge begins
  double direction_cost_px = 2;  // of each step of 15 degrees between edge and model
  double farthest_px = 20;       // larger distances count as this
  template <class V>
  void visit(V& v) {
    v("canny_low", canny_low, kNotNegative);
    v("canny_high", canny_high, kNotNegative);
    v("direction_cost_px", direction_cost_px, kNotNegative);
    v("farthest_px", farthest_px, kPositive);
  }
};

// Templates of edges, for objects without texture.
struct TemplateOptions {
  int views = 160;                // directions over the sphere: every 16 degrees
  double lowest_view_rad = -0.3;  // no views from further below the object's x-y plane
  double roll_rad = 0.25;         // the object's z axis points upwards in the image, +- this
  double nearest_diameters = 1.5;
  double farthest_diameters = 5;
  double distance_ratio = 1.2;  // from one size of a template to the next
  int points = 32;              // of a template
  int candidates = 2000;        // by their edges, to be compared with the object's look
  double look_weight = 1;  // of the look (-1 to 1) against the edges (1: as by chance; 0: best)
  int look_points = 48;    // that a candidate's look is taken at
  int refined = 24;        // of the candidates
  int verified = 10;       // of these
  ChamferOptions chamfer = {};
  template <class V>
  void visit(V& v) {
    v("views", views, Range{4, 10000});
    v("lowest_view_rad", lowest_view_rad, Range{-1.6, 1.6});
    v("roll_rad", roll_rad, Range{0, 3.2});
    v("nearest_diameters", nearest_diameters, Range{1.1, 1000});
    v("farthest_diameters", farthest_diameters, Range{1.1, 1000});
    v("distance_ratio", distance_ratio, Range{1.01, 10});
    v("points", points, Range{8, 400});
    v("candidates", candidates, Range{1, 10000});
    v("refined", refined, Range{1, 10000});
    v("verified", verified, Range{0, 10000});
    v("look_weight", look_weight, kNotNegative);
    v("look_points", look_points, Range{24, 10000});
    v("chamfer", chamfer);
  }
};

struct DetectorOptions {
  // Features.
  int max_features = 1000;  // of an image
  // Those below some 3 px take most of the time: looked for where all else fails.
  bool small_features = true;
  double match_ratio = 0.85;  // Lowe 2004: 0.8; RANSAC copes with what is wrong
  double same_place = 0.04;   // nearer features are one place, in diameters of the object
  // Pose from matches: RANSAC (Fischler and Bolles 1981).
  std::string solver = "p3p";  // or epnp: of the minimal samples
  int samples = 600;
  double inlier_px = 5;
  int min_inliers = 6;
  double min_spread = 0.1;         // of the inliers on the object, in its diameters
  int hypotheses = 3;              // for each object, the next without the inliers of the last
  TemplateOptions templates = {};  // for objects without texture
  // Verification: the health of the edges (0 to 1) and the look (-1 to 1) add up to at least this.
  // Right poses of three objects on a cluttered desk mostly reach 1.6; in 281 views without the
  // object a wrong one reached 1.46, for candidates are moved to where they look best.
  double min_evidence = 1.5;
  double min_feature_evidence = 1.35;  // where features agree, too
  double min_health = 0.5;             // in any case
  // An object half hidden has less: so many features that agree closely prove it as well, with this
  // health.
  int proving_features = 12;
  double min_hidden_health = 0.35;
  double certain_evidence = 1.75;  // no better pose is looked for, but for its rivals
  // A pose found by edges is dropped when another one, turned against it, fits hardly worse: the
  // sharpness of the edges and the look add up to nearly as much. Of 108 views of a bottle, many of
  // them hard ones, wrong sides led by up to 0.12.
  double min_lead = 0.15;
  double rival_rad = 0.35;
  double min_neighbour_lead = 0.03;  // ... where it is turned by less, but at least by
  double neighbour_rad = 0.1;
  // Few pixels prove less: below this size of the object (its diameter, px) evidence without
  // features fades by the cube root.
  double full_size_px = 100;
  int look_points = 400;
  // Of an object that is too plain for a look, and of unknown colours.
  double min_plain_health = 0.8;
  template <class V>
  void visit(V& v) {
    v("max_features", max_features, Range{1, 100000});
    v("small_features", small_features);
    v("match_ratio", match_ratio, kFraction);
    v("same_place", same_place, kFraction);
    v("solver", solver, {"p3p", "epnp"});
    v("samples", samples, Range{1, 1000000});
    v("inlier_px", inlier_px, kPositive);
    v("min_inliers", min_inliers, Range{4, 100000});
    v("min_spread", min_spread, kFraction);
    v("hypotheses", hypotheses, Range{1, 100});
    v("templates", templates);
    v("min_evidence", min_evidence, Range{0, 2});
    v("min_feature_evidence", min_feature_evidence, Range{0, 2});
    v("min_health", min_health, kFraction);
    v("proving_features", proving_features, Range{4, 100000});
    v("min_hidden_health", min_hidden_health, kFraction);
    v("certain_evidence", certain_evidence, kPositive);
    v("min_lead", min_lead, kNotNegative);
    v("rival_rad", rival_rad, kNotNegative);
    v("min_neighbour_lead", min_neighbour_lead, kNotNegative);
    v("neighbour_rad", neighbour_rad, kNotNegative);
    v("look_points", look_points, Range{24, 10000});
    v("full_size_px", full_size_px, kNotNegative);
    v("min_plain_health", min_plain_health, kFraction);
  }
};

}  // namespace diorama
