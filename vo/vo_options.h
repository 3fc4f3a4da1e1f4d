// Options of the visual odometry. Defaults are the outcome of ablations on rendered sequences;
// where a paper gives another value (SVO: Forster et al. 2014; Singhal et al. 2017), it is named,
// and docs/options/vo_paper.yaml sets them all.
#pragma once

#include "core/options.h"

namespace diorama {

struct VoOptions {
  // Features. More than some 150 that agree do not make the pose better.
  int pyramid_levels = 5;
  int cell_px = 20;        // at most one feature in each cell of the image (SVO 25 to 30)
  int max_features = 200;  // paper 400
  int min_features = 20;   // fewer that agree with a pose are a loss (paper)
  // Where fewer points are found, corners whose depth is not certain yet help (SVO 2): they hold
  // the rotation when the camera turns to what it has not seen.
  int unsettled_below = 60;
  int unsettled_open = 150;  // ... unless known points are hidden: what hides them may move
  // The weakest corner: smallest eigenvalue of the mean structure tensor, (grey levels / px)^2,
  // above what the measured noise explains. Small, for clean synthetic images have weak corners
  // too.
  double min_corner_score = 3;
  double corner_noise_factor = 3;
  // Of the tensor's smallest eigenvalue to its largest one. The steps of a straight outline that is
  // drawn or scanned without smoothing are no corners: they slide along it.
  double min_corner_ratio = 0.15;
  // Where fewer features than this are found, edges help (SVO 2); 0: never. And the weakest one:
  // largest eigenvalue.
  int edgelets_below = 60;
  double min_edge_score = 10;

  // Initialisation.
  double start_disparity_px = 10;    // median, between the first two keyframes (paper)
  double start_baseline_rad = 0.08;  // ... and their baseline over the median depth
  int start_window_frames = 45;      // after so many frames the first keyframe is taken anew
  int start_wait_frames = 30;        // for an object, before a start without scale
  int start_trial_frames = 8;        // in which objects must not contradict; 0 = none (paper)
  int start_min_points = 40;         // triangulated, or the start has failed (small images: fewer)

  // Sparse image alignment, last frame to new frame.
  int align_coarse_level = 4;
  int align_fine_level = 2;
  int align_iterations = 12;  // per level (SVO 30)
  bool align_affine = true;   // gain and offset of brightness (SVO has none)
  bool align_robust = true;   // Huber weights (SVO has none)

  // Feature alignment.
  double match_radius_px = 5;         // largest correction of a predicted position, at its level
  bool match_gain = true;             // gain of brightness, beside the offset
  bool blur_patches = true;           // as the moving image is (SVO does not)
  double host_view_angle_rad = 0.44;  // up to this the patch of the point's first keyframe is used
  double max_view_angle_rad = 1.05;   // (SVO) beyond it no patch is used
  double patch_rms_floor = 6;         // grey levels; a patch may differ by this ...
  double patch_rms_noise = 3.5;       // ... and so many times the noise of the image

  double feature_sigma_px = 0.1;  // beside what noise explains: errors of warp and interpolation

  // Pose refinement.
  int refine_iterations = 10;     // (SVO)
  double outlier_px = 2;          // (SVO) at the level of the feature
  double lost_agreement = 0.3;    // fewer of the matched features agree: lost
  double lost_drop = 0.35;        // as few, compared with the last frames, and in doubt: lost
  double covariance_scale = 1.8;  // of the standard deviations: errors of features are alike

  // Keyframes.
  double keyframe_distance = 0.12;  // of the median depth, from every keyframe that looks alike
  double keyframe_distance_m = 0;   // in metres instead, when above 0 (paper 0.05)
  double keyframe_min_share = 0.7;  // of the features of the last keyframe; fewer: a new one
  int max_keyframes = 100;          // (paper) then the farthest goes

  // Where something stands before the map nothing new enters it, lest what moves with the camera be
  // taken for the world; but for no longer than this.
  double covered_time_s = 5;

  // Depth filter.
  int max_seeds = 400;
  int max_seed_searches = 400;   // epipolar searches per frame: bounds the time
  double seed_converged = 0.02;  // sigma over inverse depth (SVO: z_range / 200)

  int max_seed_age = 120;        // frames
  double max_epipolar_px = 140;  // longest search, at its level

  // Local bundle adjustment.
  int bundle_window = 8;     // newest keyframes; 0: none (SVO)
  double bundle_time_s = 1;  // ... and all of the last second, when there are more
  int bundle_iterations = 6;
  double bundle_huber = 2;            // standard deviations
  int bundle_fixed_observations = 6;  // older ones per point, from keyframes that stay

  // Metric scale from objects.
  double scale_sigma = 0.005;          // relative; known well enough
  double scale_time_s = 3;             // objects are not asked longer than this after the start
  int scale_min_keyframes = 8;         // with objects, even when the sigma is small sooner
  double object_sigma_scale = 1;       // of the measurements' standard deviations
  double object_sigma_min_m = 0.0005;  // no measurement is better than this
  double object_sigma_min_rad = 0.001;

  template <class V>
  void visit(V& v) {
    v("pyramid_levels", pyramid_levels, Range{1, 8});
    v("cell_px", cell_px, Range{4, 1000});
    v("max_features", max_features, Range{8, 10000});
    v("min_features", min_features, Range{6, 10000});
    v("unsettled_below", unsettled_below, Range{0, 10000});
    v("unsettled_open", unsettled_open, Range{0, 10000});
    v("min_corner_score", min_corner_score, kNotNegative);
    v("corner_noise_factor", corner_noise_factor, kNotNegative);
    v("min_corner_ratio", min_corner_ratio, kFraction);
    v("edgelets_below", edgelets_below, Range{0, 10000});
    v("min_edge_score", min_edge_score, kNotNegative);
    v("start_disparity_px", start_disparity_px, kPositive);
    v("start_baseline_rad", start_baseline_rad, kNotNegative);
    v("start_window_frames", start_window_frames, Range{2, 100000});
    v("start_wait_frames", start_wait_frames, Range{0, 100000});
    v("start_trial_frames", start_trial_frames, Range{0, 10000});
    v("start_min_points", start_min_points, Range{8, 10000});
    v("align_coarse_level", align_coarse_level, Range{0, 7});
    v("align_fine_level", align_fine_level, Range{0, 7});
    v("align_iterations", align_iterations, Range{1, 1000});
    v("align_affine", align_affine);
    v("align_robust", align_robust);
    v("match_radius_px", match_radius_px, kPositive);
    v("match_gain", match_gain);
    v("blur_patches", blur_patches);
    v("host_view_angle_rad", host_view_angle_rad, Range{0, 1.6});
    v("max_view_angle_rad", max_view_angle_rad, Range{0, 1.6});
    v("patch_rms_floor", patch_rms_floor, kPositive);
    v("patch_rms_noise", patch_rms_noise, kNotNegative);
    v("feature_sigma_px", feature_sigma_px, kPositive);
    v("refine_iterations", refine_iterations, Range{1, 1000});
    v("outlier_px", outlier_px, kPositive);
    v("lost_agreement", lost_agreement, kFraction);
    v("lost_drop", lost_drop, kFraction);
    v("covariance_scale", covariance_scale, kPositive);
    v("keyframe_distance", keyframe_distance, kPositive);
    v("keyframe_distance_m", keyframe_distance_m, kNotNegative);
    v("keyframe_min_share", keyframe_min_share, kFraction);
    v("max_keyframes", max_keyframes, Range{4, 100000});
    v("covered_time_s", covered_time_s, kNotNegative);
    v("max_seeds", max_seeds, Range{0, 100000});
    v("max_seed_searches", max_seed_searches, Range{1, 100000});
    v("seed_converged", seed_converged, kPositive);

    v("max_seed_age", max_seed_age, Range{1, 100000});
    v("max_epipolar_px", max_epipolar_px, kPositive);
    v("bundle_window", bundle_window, Range{0, 1000});
    v("bundle_time_s", bundle_time_s, kNotNegative);
    v("bundle_iterations", bundle_iterations, Range{1, 1000});
    v("bundle_huber", bundle_huber, kPositive);
    v("bundle_fixed_observations", bundle_fixed_observations, Range{0, 1000});
    v("scale_sigma", scale_sigma, kPositive);
    v("scale_time_s", scale_time_s, kNotNegative);
    v("scale_min_keyframes", scale_min_keyframes, Range{2, 1000});
    v("object_sigma_scale", object_sigma_scale, kPositive);
    v("object_sigma_min_m", object_sigma_min_m, kPositive);
    v("object_sigma_min_rad", object_sigma_min_rad, kPositive);
  }
};

}  // namespace diorama
