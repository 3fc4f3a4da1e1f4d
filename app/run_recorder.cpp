#include "app/run_recorder.h"

#include <algorithm>

#include "app/run_json.h"
#include "core/measurements_io.h"
#include "core/text.h"
#include "eval/csv.h"
#include "eval/statistics.h"
#include "eval/trajectory_errors.h"

namespace diorama {
namespace {

constexpr const char* kCameraOnline = "camera_online.txt";
constexpr const char* kOdometryWorld = "odometry_world.txt";
constexpr const char* kFrames = "frames.csv";
constexpr const char* kMeasurements = "measurements.csv";
constexpr const char* kErrors = "errors.csv";  // of what is reported
constexpr const char* kTiming = "timing.csv";

std::string objectFile(const ObjectModel& model) { return "objects/" + model.name + ".txt"; }

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

std::string errorFields(const std::optional<PoseError>& error) {
  return error ? formatNumber(error->translation_m) + "," + formatNumber(error->rotation_rad) : ",";
}

std::string framesRow(const std::string& source, bool claimed, double health, const SE3& pose,
                      const Matrix6d& covariance, const std::optional<PoseError>& error,
                      const std::optional<double>& visible_fraction) {
  return source + (claimed ? ",1," : ",0,") + formatNumber(health) + "," + formatPose(pose, ',') +
         "," + formatUpperTriangle(covariance, ',') + "," + errorFields(error) + "," +
         optionalField(visible_fraction) + "\n";
}

std::optional<PoseError> errorOf(const SE3& T_camera_object, const std::optional<SE3>& truth,
                                 const Symmetries& symmetries) {
  if (!truth) return std::nullopt;
  return poseError(T_camera_object, nearestSymmetricPose(T_camera_object, *truth, symmetries));
}

}  // namespace

RunRecorder::RunRecorder(Method method, std::vector<ObjectModel> objects,
                         std::filesystem::path folder)
    : method_(method),
      models_(std::move(objects)),
      files_(std::move(folder)),
      evaluations_(models_.begin(), models_.end()),
      judged_(models_.size()),
      last_truth_(models_.size()),
      reinitialisations_(models_.size(), 0) {
  begin();
}

// What has no rows is there all the same.
void RunRecorder::begin() {
  if (method_ != Method::kEbt) files_.append(kCameraOnline, "");
  if (method_ == Method::kFused) files_.append(kOdometryWorld, "");
  for (const ObjectModel& model : models_) files_.append(objectFile(model), "");
  files_.append(kFrames, framesHeader());
  files_.append(kMeasurements, measurementsHeader());
  files_.append(kErrors, "frame,timestamp,object,held,err_m,err_rad,visible_fraction\n");
  files_.append(kTiming, "frame,timestamp,odometry_ms,tracker_ms,mapper_ms\n");
}

void RunRecorder::add(int number, int64_t timestamp_ns, const FrameResult& result,
                      const std::optional<GroundTruth>& truth) {
  const std::string prefix = std::to_string(number) + "," + formatSeconds(timestamp_ns) + ",";
  if (result.T_world_camera) {
    camera_online_.poses.push_back({timestamp_ns, *result.T_world_camera});
    files_.append(kCameraOnline, toTum(camera_online_.poses.back()));
  }
  if (result.T_world_odometry)
    files_.append(kOdometryWorld, toTum({timestamp_ns, *result.T_world_odometry}));
  if (truth) {
    camera_truth_.poses.push_back({timestamp_ns, truth->T_world_camera});
    files_.append("truth/camera.txt", toTum(camera_truth_.poses.back()));
  }
  const bool starts = !start_frame_ && (result.T_world_camera || method_ == Method::kEbt);
  if (starts) start_frame_ = number;
  if (starts && truth) first_camera_truth_ = truth->T_world_camera;
  if (start_frame_) ++frames_since_start_;
  addOdometry(prefix, result, truth);
  judge(result, truth);
  for (size_t i = 0; i < models_.size(); ++i) addObject(i, prefix, timestamp_ns, result.objects[i]);
  files_.append(kTiming, prefix + formatFixed(result.odometry_ms, 3) + "," +
                             formatFixed(result.tracker_ms, 3) + "," +
                             formatFixed(result.mapper_ms, 3) + "\n");
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
  const Matrix6d covariance = m.covarianceWithScale();
  std::optional<PoseError> error;
  const StampedPose* before = camera_truth_.nearest(m.from_ns, 0);
  if (before && truth) {
    const SE3 motion = before->pose.inverse() * truth->T_world_camera;
    error = poseError(m.T_from_to, motion);
    if (m.health > 0)
      if (const auto nees = normalisedError(m.T_from_to, covariance, motion))
        odometry_nees_.push_back(*nees);
  }
  files_.append(kFrames, prefix + framesRow("odometry", m.health > 0, m.health, m.T_from_to,
                                            covariance, error, {}));
  if (m.health > 0) files_.append(kMeasurements, toCsv(m));
}

void RunRecorder::judge(const FrameResult& result, const std::optional<GroundTruth>& truth) {
  for (size_t i = 0; i < models_.size(); ++i) {
    JudgedObject& judged = judged_[i] = {};
    if (!truth) continue;
    for (const ObjectTruth& object : truth->objects)
      if (object.name == models_[i].name) {
        judged.truth = truth->T_world_camera.inverse() * object.T_world_object;
        judged.visible_fraction = object.visibleFraction();
        last_truth_[i] = object.T_world_object;
      }
    if (const auto& reported = result.objects[i].T_camera_object)
      judged.error = errorOf(*reported, judged.truth, models_[i].symmetries);
  }
}

void RunRecorder::addObject(size_t index, const std::string& prefix, int64_t timestamp_ns,
                            const ObjectResult& result) {
  const ObjectModel& model = models_[index];
  const JudgedObject& judged = judged_[index];
  if (judged.truth)
    files_.append("truth/" + objectFile(model), toTum({timestamp_ns, *judged.truth}));
  if (result.T_camera_object)
    files_.append(objectFile(model), toTum({timestamp_ns, *result.T_camera_object}));
  ObjectFrame frame;
  frame.truth = judged.truth;
  frame.reported = result.T_camera_object;
  frame.visible_fraction = judged.visible_fraction;
  std::string held;
  if (result.measurement) {
    const ObjectMeasurement& m = *result.measurement;
    held = m.claimed ? "1" : "0";
    frame.claimed = m.claimed;
    frame.raw = m.T_camera_object;
    frame.raw_covariance = m.covariance;
    files_.append(kFrames,
                  prefix + framesRow(m.object, m.claimed, m.health, m.T_camera_object, m.covariance,
                                     errorOf(m.T_camera_object, judged.truth, model.symmetries),
                                     judged.visible_fraction));
    if (m.claimed) files_.append(kMeasurements, toCsv(m));
  }
  evaluations_[index].add(frame);
  files_.append(kErrors, prefix + csvField(model.name) + "," + held + "," +
                             errorFields(judged.error) + "," +
                             optionalField(judged.visible_fraction) + "\n");
}

void RunRecorder::finish(const FinalEstimate& final) {
  if (method_ != Method::kEbt) files_.append("camera.txt", toTum(final.camera));
  files_.append("map.json", mapJson(final.map));
  files_.append("models.json", modelsJson(models_));
  files_.append("events.csv", events_.csv());
  files_.commit();
}

CameraMetrics RunRecorder::cameraMetrics() const {
  CameraMetrics metrics;
  if (method_ == Method::kEbt) return metrics;
  metrics.tracked_ratio =
      start_frame_ ? std::optional(double(healthy_frames_) / frames_since_start_) : std::nullopt;
  if (const auto nees = summarise(odometry_nees_)) metrics.odometry_nees = nees->mean;
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
    NamedObjectMetrics object{models_[i].name, evaluations_[i].metrics()};
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
