// Everything that `metrics.json` holds. Each struct names its fields once, in `visit`; what is not
// known has no value and is written as null.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace diorama {

struct CameraMetrics {
  std::optional<double> ate_mean_m, ate_std_m, ate_median_m, ate_rmse_m;
  std::optional<double> rpe_trans_rmse_m, rpe_rot_rmse_rad;
  std::optional<double> sim3_scale;
  std::optional<double> tracked_ratio;  // healthy frames over frames since start_frame
  std::optional<double> odometry_nees;

  // v(name, field) for each; `self` is const or not.
  template <class Self, class V>
  static void visit(Self& self, V&& v) {
    v("ate_mean_m", self.ate_mean_m);
    v("ate_std_m", self.ate_std_m);
    v("ate_median_m", self.ate_median_m);
    v("ate_rmse_m", self.ate_rmse_m);
    v("rpe_trans_rmse_m", self.rpe_trans_rmse_m);
    v("rpe_rot_rmse_rad", self.rpe_rot_rmse_rad);
    v("sim3_scale", self.sim3_scale);
    v("tracked_ratio", self.tracked_ratio);
    v("odometry_nees", self.odometry_nees);
  }
};

struct ObjectMetrics {
  // Over reported frames whose translation error is below 0.5 m.
  std::optional<double> mean_error_m, std_error_m, median_error_m, mean_error_rad;
  std::optional<double> ratio_below_0_5_m;                   // those over all frames
  std::optional<double> success_5cm_5deg, success_1cm_1deg;  // over all frames
  std::optional<double> success_visible_5cm_5deg;            // visible_fraction >= 0.4
  std::optional<double> success_visible_1cm_1deg;
  std::optional<double> add_auc_10cm;                   // over all frames
  std::optional<double> reported_ratio, claimed_ratio;  // over all frames
  std::optional<double> false_claim_ratio;              // over claimed frames
  std::optional<double> tracker_nees;                   // over claimed frames
  std::optional<int> reinitialisations;
  std::optional<double> map_error_m, map_error_rad, map_nees;

  template <class Self, class V>
  static void visit(Self& self, V&& v) {
    v("mean_error_m", self.mean_error_m);
    v("std_error_m", self.std_error_m);
    v("median_error_m", self.median_error_m);
    v("mean_error_rad", self.mean_error_rad);
    v("ratio_below_0_5_m", self.ratio_below_0_5_m);
    v("success_5cm_5deg", self.success_5cm_5deg);
    v("success_1cm_1deg", self.success_1cm_1deg);
    v("success_visible_5cm_5deg", self.success_visible_5cm_5deg);
    v("success_visible_1cm_1deg", self.success_visible_1cm_1deg);
    v("add_auc_10cm", self.add_auc_10cm);
    v("reported_ratio", self.reported_ratio);
    v("claimed_ratio", self.claimed_ratio);
    v("false_claim_ratio", self.false_claim_ratio);
    v("tracker_nees", self.tracker_nees);
    v("reinitialisations", self.reinitialisations);
    v("map_error_m", self.map_error_m);
    v("map_error_rad", self.map_error_rad);
    v("map_nees", self.map_nees);
  }
};

struct TimingMetrics {
  std::optional<double> wall_s, frames_per_s;
  std::optional<double> render_ms, vo_ms, tracker_ms, mapper_ms;  // mean per frame
  std::optional<int> dropped_frames;

  template <class Self, class V>
  static void visit(Self& self, V&& v) {
    v("wall_s", self.wall_s);
    v("frames_per_s", self.frames_per_s);
    v("render_ms", self.render_ms);
    v("vo_ms", self.vo_ms);
    v("tracker_ms", self.tracker_ms);
    v("mapper_ms", self.mapper_ms);
    v("dropped_frames", self.dropped_frames);
  }
};

struct NamedObjectMetrics {
  std::string name;
  ObjectMetrics metrics;
};

struct Metrics {
  std::string scene, method, initial;
  uint64_t seed = 0;
  int frames = 0;
  std::optional<int> start_frame;  // number of the first frame with an estimate
  CameraMetrics camera;
  std::vector<NamedObjectMetrics> objects;
  TimingMetrics timing;
  std::optional<double> peak_memory_mb;
};

// One number with its dotted name in metrics.json: camera.ate_mean_m, objects.NAME.mean_error_m.
struct MetricValue {
  std::string path;
  std::optional<double> value;
};

// Every number, in the order of the file.
std::vector<MetricValue> listMetrics(const Metrics& metrics);

}  // namespace diorama
