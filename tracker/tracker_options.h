// Options of the edge-based object tracker. Defaults are the outcome of ablations on a synthetic
// sequence with exact truth and on real video; where a paper gives a value, it is named.
#pragma once

#include "core/options.h"
#include "tracker/filter_options.h"

namespace diorama {

struct TrackerOptions {
  // Model edges. An edge between two faces is sharp when |n1 . n2| is at most this (a dihedral
  // between 25.8 and 154.2 degrees, Choi and Christensen 2012).
  double sharp_edge_cosine = 0.9;
  // Up to this the mesh's own normals are believed where they run on smoothly across a fold: it
  // stands for a round surface and shows on the outline alone. 1 = never.
  double rounded_edge_cosine = 0.5;
  // Smooth edges between faces flatter than this cannot be told from a plane and are dropped.
  double flat_edge_cosine = 0.99999;
  double weld_tolerance = 1e-4;    // vertices nearer than this, in model diameters, are one
  int samples_per_diameter = 128;  // spacing of the points on edges that can remember contrast

  // Measurement along the normals of projected edges.
  double sample_step_px = 8;  // distance of samples along a projected edge ...
  double sample_step_m = 0;   // ... or along the edge itself (paper: 0.01); 0 = in the image
  int max_samples = 200;      // more bring time but no accuracy
  int min_samples = 16;       // fewer are no measurement
  int start_search_px = 16;   // range of the first round from a given pose
  int wide_search_px = 8;     // ranges of the rounds in every frame
  int narrow_search_px = 3;
  double min_contrast = 12;        // grey levels across an edge
  double plain_contrast = 50;      // edges weaker than this are sought in colours, too; 0 = never
  bool nearest_edges = false;      // of many edges the nearest are kept (paper), not the strongest
  double contrast_tolerance = 20;  // grey levels; neither side like the remembered one: a doubt ...
  double contrast_penalty_px = 3;  // ... that counts like this distance, since contrast can flip

  // Robust Gauss-Newton.
  int solver_iterations = 3;       // per round of search
  double tukey_constant = 4.6851;  // 95% efficiency under normal errors
  double wide_sigma_px = 0.5;      // smallest robust scale of edges, wide rounds
  double narrow_sigma_px = 0.13;   // ... and in the last round
  double texture_sigma_px = 0.1;   // smallest robust scale of texture patches
  // Errors that residuals share: so many of them count as one.
  double edge_correlation = 8;       // neighbouring samples of one edge
  double edge_offset_px = 0.25;      // displacement that a whole side of the outline shares
  double texture_correlation = 4;    // patches under one light and blur
  double print_correlation = 1;      // ... of the print, whose place is known: none
  double keyframe_correlation = 30;  // edges of consecutive frames
  double damping = 1e-4;             // of each normal equation, relative

  // Direct alignment of the last good frame's pixels, pyramid levels 3 and 2.
  int direct_points = 300;
  int direct_iterations = 12;  // per level
  double direct_vote_px = 6;   // a larger step must have the edges' agreement

  // Texture patches of a keyframe.
  int texture_patches = 40;
  int print_patches = 30;              // of the model's own textures
  double patch_correlation = 0.8;      // smallest normalised correlation of an aligned patch
  double keyframe_agreement = 0.5;     // a new keyframe when fewer patches agree,
  double keyframe_view_cosine = 0.94;  // when the view turned by 20 degrees
  double keyframe_scale = 1.3;         // or when the distance changed by this factor

  // Colours beside the outline.
  double region_correlation = 4;  // so many normals of those compared count as one; 0 = no colours
  double region_rate = 0.2;       // of the running means of what is seen inside and beside
  double region_doubt = 3;        // of an edge: this logarithm of a likelihood less than elsewhere

  // Health: the share of visible samples with an agreeing edge beyond what chance would bring.
  // Between `lost` and `claim` the pose is followed for a while, but neither claimed nor
  // remembered.
  double inlier_px = 1.5;
  double claim_health = 0.35;    // an object half hidden is still claimed
  double start_health = 0.65;    // after a start, a doubt or a loss: 2% of wrong poses that were
                                 // fitted in clutter reach it
  double kept_health = 0.5;      // ... when the given pose was right within wide_search_px
  double certain_health = 0.85;  // of a start that needs no comparison with others around it
  double lost_health = 0.2;
  int doubtful_frames = 10;        // in a row, before the object is lost
  double claim_sigma_m = 0.03;     // a pose that is less certain is not claimed: 0.6 of what counts
  double claim_sigma_rad = 0.052;  // as lost, 5 cm and 5 degrees

  // Neighbours of a start, compared by how sharply their edges agree.
  double fit_sigma_px = 0.3;  // that edges of the right pose keep, but for a few
  double neighbour_px = 3;    // to a neighbour, rms of its edges along their normals
  int neighbour_rounds = 4;   // 0 = none are tried

  // What the surface looked like tells where something covers it: edges there are not the object's.
  int surface_points = 1200;      // on the whole object; 0 = covers are not looked for
  double surface_tolerance = 15;  // levels of any colour, beyond the light's change
  int surface_patience = 90;      // frames, until a changed part is the object's new look
  double enough_uncovered = 0.4;  // share of the samples; with fewer the health falls

  // Rescue of an unhealthy track by random starts around the prediction.
  int rescue_starts = 8;       // aligned, after screening by grey values ...
  int rescue_screened = 200;   // ... out of this many
  double rescue_sigma = 0.07;  // rad at the camera (half) and twice it about the object

  // Hypotheses that are carried from frame to frame: one that is refined, or a particle filter.
  int particles = 1;
  FilterOptions filter;
  int seed = 1;

  template <class V>
  void visit(V& v) {
    visitEdges(v);
    visitCues(v);
    visitHealth(v);
    visitSearch(v);
  }

 private:
  template <class V>
  void visitEdges(V& v) {
    v("sharp_edge_cosine", sharp_edge_cosine, kFraction);
    v("rounded_edge_cosine", rounded_edge_cosine, kFraction);
    v("flat_edge_cosine", flat_edge_cosine, kFraction);
    v("weld_tolerance", weld_tolerance, Range{0, 0.1});
    v("samples_per_diameter", samples_per_diameter, Range{8, 4096});
    v("sample_step_px", sample_step_px, Range{1, 64});
    v("sample_step_m", sample_step_m, kNotNegative);
    v("max_samples", max_samples, Range{16, 10000});
    v("min_samples", min_samples, Range{6, 10000});
    v("start_search_px", start_search_px, Range{1, 32});
    v("wide_search_px", wide_search_px, Range{1, 32});
    v("narrow_search_px", narrow_search_px, Range{1, 32});
    v("min_contrast", min_contrast, Range{0, 255});
    v("plain_contrast", plain_contrast, Range{0, 255});
    v("nearest_edges", nearest_edges);
    v("contrast_tolerance", contrast_tolerance, Range{0, 255});
    v("contrast_penalty_px", contrast_penalty_px, kNotNegative);
  }

  template <class V>
  void visitCues(V& v) {
    v("solver_iterations", solver_iterations, Range{1, 100});
    v("tukey_constant", tukey_constant, kPositive);
    v("wide_sigma_px", wide_sigma_px, kPositive);
    v("narrow_sigma_px", narrow_sigma_px, kPositive);
    v("texture_sigma_px", texture_sigma_px, kPositive);
    v("edge_correlation", edge_correlation, Range{1, 1000});
    v("edge_offset_px", edge_offset_px, kNotNegative);
    v("texture_correlation", texture_correlation, Range{1, 1000});
    v("print_correlation", print_correlation, Range{1, 1000});
    v("keyframe_correlation", keyframe_correlation, Range{1, 1000});
    v("damping", damping, kNotNegative);
    v("direct_points", direct_points, Range{0, 10000});
    v("direct_iterations", direct_iterations, Range{1, 100});
    v("direct_vote_px", direct_vote_px, kNotNegative);
    v("texture_patches", texture_patches, Range{0, 1000});
    v("print_patches", print_patches, Range{0, 1000});
    v("patch_correlation", patch_correlation, kFraction);
    v("keyframe_agreement", keyframe_agreement, kFraction);
    v("keyframe_view_cosine", keyframe_view_cosine, Range{-1, 1});
    v("keyframe_scale", keyframe_scale, Range{1, 100});
    v("region_correlation", region_correlation, Range{0, 1000});
    v("region_rate", region_rate, kFraction);
    v("region_doubt", region_doubt, kPositive);
  }

  template <class V>
  void visitHealth(V& v) {
    v("inlier_px", inlier_px, kPositive);
    v("claim_health", claim_health, kFraction);
    v("start_health", start_health, kFraction);
    v("kept_health", kept_health, kFraction);
    v("certain_health", certain_health, kFraction);
    v("lost_health", lost_health, kFraction);
    v("doubtful_frames", doubtful_frames, Range{0, 100000});
    v("claim_sigma_m", claim_sigma_m, kPositive);
    v("claim_sigma_rad", claim_sigma_rad, kPositive);
  }

  template <class V>
  void visitSearch(V& v) {
    v("fit_sigma_px", fit_sigma_px, kPositive);
    v("neighbour_px", neighbour_px, kPositive);
    v("neighbour_rounds", neighbour_rounds, Range{0, 100});
    v("surface_points", surface_points, Range{0, 100000});
    v("surface_tolerance", surface_tolerance, Range{0, 255});
    v("surface_patience", surface_patience, Range{0, 100000});
    v("enough_uncovered", enough_uncovered, kFraction);
    v("rescue_starts", rescue_starts, Range{0, 1000});
    v("rescue_screened", rescue_screened, Range{0, 100000});
    v("rescue_sigma", rescue_sigma, kNotNegative);
    v("particles", particles, Range{1, 1000});
    v("filter", filter);
    v("seed", seed, Range{0, 2147483647});
  }
};

}  // namespace diorama
