#include "app/run_recorder.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/files.h"
#include "core/measurements_io.h"
#include "core/text.h"
#include "eval/pose_errors.h"
#include "eval/trajectory_errors.h"

namespace diorama {
namespace {

std::string framesHeader() {
  const std::string measurement = measurementsHeader();
  return "frame,timestamp,source,claimed,health,tx,ty,tz,qx,qy,qz,qw" +
         measurement.substr(measurement.find(",c00"),
                            measurement.rfind(",c55") + 4 - measurement.find(",c00")) +
         ",err_m,err_rad,visible_fraction\n";
}

std::string optionalField(const std::optional<double>& value) {
  return value ? formatNumber(*value) : "";
}

std::string framesRow(const std::string& source, bool claimed, double health, const SE3& pose,
                      const Matrix6d& covariance, const std::optional<PoseError>& error,
                      const std::optional<double>& visible_fraction) {
  std::string row = source + (claimed ? ",1," : ",0,") + formatNumber(health) + "," +
                    formatPose(pose, ',') + "," + formatUpperTriangle(covariance, ',') + ",";
  row += error ? formatNumber(error->translation_m) + "," + formatNumber(error->rotation_rad) : ",";
  return row + "," + optionalField(visible_fraction) + "\n";
}

nlohmann::ordered_json rowMajor(const auto& matrix) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (int row = 0; row < matrix.rows(); ++row)
    for (int column = 0; column < matrix.cols(); ++column) list.push_back(matrix(row, column));
  return list;
}

std::string mapJson(const MapEstimate& map) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::object();
  for (const ObjectEstimate& object : map.objects)
    objects[object.name] = {{"T_world_object", rowMajor(object.T_world_object.matrix())},
                            {"covariance", rowMajor(object.covariance)}};
  return nlohmann::ordered_json{{"objects", objects}}.dump(2) + "\n";
}

}  // namespace

RunRecorder::RunRecorder(Method method, std::vector<ObjectModel> objects)
    : method_(method),
      models_(std::move(objects)),
      object_paths_(models_.size()),
      object_frames_(models_.size()),
      last_truth_(models_.size()),
      reinitialisations_(models_.size(), 0),
      frames_csv_(framesHeader()),
      measurements_csv_(measurementsHeader()) {}

void RunRecorder::add(int number, int64_t timestamp_ns, const FrameResult& result,
                      const std::optional<GroundTruth>& truth) {
  const std::string prefix = std::to_string(number) + "," + formatSeconds(timestamp_ns) + ",";
  if (result.T_world_camera) camera_online_.poses.push_back({timestamp_ns, *result.T_world_camera});
  if (result.T_world_odometry)
    odometry_world_.poses.push_back({timestamp_ns, *result.T_world_odometry});
  if (truth) camera_truth_.poses.push_back({timestamp_ns, truth->T_world_camera});
  const bool starts = !start_frame_ && (result.T_world_camera || method_ == Method::kEbt);
  if (starts) start_frame_ = number;
  if (starts && truth) first_camera_truth_ = truth->T_world_camera;
  if (start_frame_) ++frames_since_start_;
  addOdometry(prefix, result, truth);
  for (size_t i = 0; i < models_.size(); ++i) {
    ObjectFrame frame;
    if (truth)
      for (const ObjectTruth& object : truth->objects)
        if (object.name == models_[i].name) {
          frame.truth = truth->T_world_camera.inverse() * object.T_world_object;
          frame.visible_fraction = object.visibleFraction();
          last_truth_[i] = object.T_world_object;
        }
    object_frames_[i].push_back(frame);
    addObject(i, prefix, result.objects[i]);
    if (result.objects[i].T_camera_object)
      object_paths_[i].poses.push_back({timestamp_ns, *result.objects[i].T_camera_object});
  }
  events_.add(result.events);
  for (const Event& event : result.events)
    for (size_t i = 0; i < models_.size(); ++i)
      reinitialisations_[i] +=
          event.event == "reinitialised" && event.source == models_[i].name ? 1 : 0;
  odometry_ms_ += result.odometry_ms;
  tracker_ms_ += result.tracker_ms;
  mapper_ms_ += result.mapper_ms;
  ++frames_;
}

void RunRecorder::addOdometry(const std::string& prefix, const FrameResult& result,
                              const std::optional<GroundTruth>& truth) {
  const bool first = start_frame_ && frames_since_start_ == 1;
  if (start_frame_ && (first || (result.odometry && result.odometry->health > 0)))
    ++healthy_frames_;
  if (!result.odometry) return;
  const OdometryMeasurement& m = *result.odometry;
  std::optional<PoseError> error;
  const StampedPose* before = camera_truth_.nearest(m.from_ns, 0);
  if (before && truth) {
    const SE3 motion = before->pose.inverse() * truth->T_world_camera;
    error = poseError(m.T_from_to, motion);
    if (m.health > 0) odometry_frames_.push_back({m.T_from_to, m.covariance, motion});
  }
  frames_csv_ +=
      prefix + framesRow("odometry", m.health > 0, m.health, m.T_from_to, m.covariance, error, {});
  if (m.health > 0) measurements_csv_ += toCsv(m);
}

void RunRecorder::addObject(size_t index, const std::string& prefix, const ObjectResult& result) {
  ObjectFrame& frame = object_frames_[index].back();
  frame.reported = result.T_camera_object;
  if (!result.measurement) return;
  const ObjectMeasurement& m = *result.measurement;
  frame.claimed = m.claimed;
  frame.raw = m.T_camera_object;
  frame.raw_covariance = m.covariance;
  std::optional<PoseError> error;
  if (frame.truth)
    error = poseError(m.T_camera_object, nearestSymmetricPose(m.T_camera_object, *frame.truth,
                                                              models_[index].symmetries));
  frames_csv_ += prefix + framesRow(m.object, m.claimed, m.health, m.T_camera_object, m.covariance,
                                    error, frame.visible_fraction);
  if (m.claimed) measurements_csv_ += toCsv(m);
}

std::optional<SE3> RunRecorder::truth(size_t object) const {
  return object_frames_[object].empty() ? std::nullopt : object_frames_[object].back().truth;
}

std::optional<double> RunRecorder::error_m(size_t object) const {
  if (object_frames_[object].empty()) return std::nullopt;
  const ObjectFrame& frame = object_frames_[object].back();
  if (!frame.truth || !frame.reported) return std::nullopt;
  return poseError(*frame.reported,
                   nearestSymmetricPose(*frame.reported, *frame.truth, models_[object].symmetries))
      .translation_m;
}

void RunRecorder::write(const std::filesystem::path& folder, const FinalEstimate& final) const {
  createFolder(folder / "objects");
  if (method_ != Method::kEbt) {
    writeFileAtomically(folder / "camera_online.txt", toTum(camera_online_));
    writeFileAtomically(folder / "camera.txt", toTum(final.camera));
  }
  if (method_ == Method::kFused)
    writeFileAtomically(folder / "odometry_world.txt", toTum(odometry_world_));
  for (size_t i = 0; i < models_.size(); ++i)
    writeFileAtomically(folder / "objects" / (models_[i].name + ".txt"), toTum(object_paths_[i]));
  writeFileAtomically(folder / "map.json", mapJson(final.map));
  writeFileAtomically(folder / "frames.csv", frames_csv_);
  writeFileAtomically(folder / "measurements.csv", measurements_csv_);
  writeFileAtomically(folder / "events.csv", events_.csv());
}

CameraMetrics RunRecorder::cameraMetrics() const {
  CameraMetrics metrics;
  if (method_ == Method::kEbt) return metrics;
  metrics.tracked_ratio =
      start_frame_ ? std::optional(double(healthy_frames_) / frames_since_start_) : std::nullopt;
  metrics.odometry_nees = odometryNees(odometry_frames_);
  const TrajectoryErrors errors =
      evaluateTrajectory(camera_online_, camera_truth_, Alignment::kSE3);
  metrics.sim3_scale = errors.sim3_scale;
  if (errors.ape_trans_m) {
    metrics.ate_mean_m = errors.ape_trans_m->mean;
    metrics.ate_std_m = errors.ape_trans_m->std;
    metrics.ate_median_m = errors.ape_trans_m->median;
    metrics.ate_rmse_m = errors.ape_trans_m->rmse;
  }
  if (errors.rpe_trans_m) metrics.rpe_trans_rmse_m = errors.rpe_trans_m->rmse;
  if (errors.rpe_rot_rad) metrics.rpe_rot_rmse_rad = errors.rpe_rot_rad->rmse;
  return metrics;
}

Metrics RunRecorder::metrics(const FinalEstimate& final) const {
  Metrics metrics;
  metrics.frames = frames_;
  metrics.start_frame = start_frame_;
  metrics.camera = cameraMetrics();
  for (size_t i = 0; i < models_.size(); ++i) {
    NamedObjectMetrics object{models_[i].name, evaluateObject(object_frames_[i], models_[i])};
    if (method_ != Method::kVo) object.metrics.reinitialisations = reinitialisations_[i];
    for (const ObjectEstimate& estimate : final.map.objects)
      if (estimate.name == models_[i].name && first_camera_truth_ && last_truth_[i])
        evaluateMap(estimate, first_camera_truth_->inverse() * *last_truth_[i],
                    models_[i].symmetries, object.metrics);
    metrics.objects.push_back(std::move(object));
  }
  const double n = std::max(1, frames_);
  if (method_ != Method::kEbt) metrics.timing.vo_ms = odometry_ms_ / n;
  if (method_ != Method::kVo) metrics.timing.tracker_ms = tracker_ms_ / n;
  if (method_ == Method::kFused) metrics.timing.mapper_ms = mapper_ms_ / n;
  return metrics;
}

}  // namespace diorama
