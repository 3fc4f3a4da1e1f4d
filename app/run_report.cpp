#include "app/run_report.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "app/option_list.h"
#include "app/run_folder.h"
#include "app/video_frames.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "eval/report_page.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxFrames = 3000;  // in the page; of longer runs every second, third ... frame
constexpr size_t kWorstFrames = 8;
constexpr int kWorstGap_frames = 15;  // between two that are shown: neighbours look alike
constexpr uintmax_t kMaxVideo_bytes = 64u << 20;

// Short texts: a number that is a multiple of a power of ten prints as one.
double decimals(double value, int n) {
  const double factor = std::pow(10, n);
  return std::round(value * factor) / factor;
}

Json numberList(const PerFrame<double>& values, int digits, size_t step) {
  Json list = Json::array();
  for (size_t i = 0; i < values.size(); i += step)
    list.push_back(values[i] ? Json(decimals(*values[i], digits)) : Json());
  return list;
}

Json poseJson(const SE3& T) {
  Json pose = Json::array();
  for (int k = 0; k < 3; ++k) pose.push_back(decimals(T.translation[k], 5));
  for (double q : {T.rotation.x(), T.rotation.y(), T.rotation.z(), T.rotation.w()})
    pose.push_back(decimals(q, 5));
  return pose;
}

Json poseList(const PerFrame<SE3>& poses, size_t step) {
  Json list = Json::array();
  for (size_t i = 0; i < poses.size(); i += step)
    list.push_back(poses[i] ? poseJson(*poses[i]) : Json());
  return list;
}

// One sigma of the translation, in the frame of the pose: [radii, quaternion].
Json ellipsoidJson(const Matrix6d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(covariance.topLeftCorner<3, 3>());
  if (axes.info() != Eigen::Success || !axes.eigenvalues().allFinite() ||
      axes.eigenvalues()[0] < 0 || axes.eigenvalues()[2] > 1e4)
    return nullptr;
  Matrix3d R = axes.eigenvectors();
  if (R.determinant() < 0) R.col(0) *= -1;
  const Eigen::Quaterniond q(R);
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(decimals(std::sqrt(axes.eigenvalues()[k]), 7));
  for (double v : {q.x(), q.y(), q.z(), q.w()}) list.push_back(decimals(v, 4));
  return list;
}

// Into the frame that is shown. With truth: its world, laid over the estimate where that starts.
// Without: the estimate's, turned so that what was up in the first picture is up.
struct Display {
  SE3 T_shown_estimate;
  bool truth = false;
};

Display displayOf(const RunFolder& run) {
  for (size_t i = 0; i < run.frames.size(); ++i) {
    if (!run.T_world_camera_true[i]) continue;
    if (run.T_world_camera[i])
      return {*run.T_world_camera_true[i] * run.T_world_camera[i]->inverse(), true};
    if (run.metrics.value("method", "") == "ebt") return {*run.T_world_camera_true[i], true};
  }
  Matrix3d R;  // camera axes (x right, y down, z forward) in a world with z up
  R << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return {{Eigen::Quaterniond(R), Vector3d::Zero()}, false};
}

// The camera that carries what is seen from it: the estimated one, in ebt the true one, else one
// that stands still.
PerFrame<SE3> carriers(const RunFolder& run, const Display& display) {
  PerFrame<SE3> cameras(run.frames.size());
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (run.T_world_camera[i])
      cameras[i] = display.T_shown_estimate * *run.T_world_camera[i];
    else if (display.truth && run.T_world_camera_true[i])
      cameras[i] = *run.T_world_camera_true[i];
    else if (!display.truth)
      cameras[i] = display.T_shown_estimate;
  }
  return cameras;
}

PerFrame<SE3> product(const PerFrame<SE3>& a, const PerFrame<SE3>& b) {
  PerFrame<SE3> out(a.size());
  for (size_t i = 0; i < a.size(); ++i)
    if (a[i] && b[i]) out[i] = *a[i] * *b[i];
  return out;
}

Json cameraJson(const RunFolder& run, const Display& display, size_t step) {
  PerFrame<SE3> estimated(run.frames.size()), truth(run.frames.size());
  PerFrame<double> error(run.frames.size());
  for (size_t i = 0; i < run.frames.size(); ++i) {
    if (run.T_world_camera[i]) estimated[i] = display.T_shown_estimate * *run.T_world_camera[i];
    if (display.truth) truth[i] = run.T_world_camera_true[i];
    if (estimated[i] && truth[i])
      error[i] = (estimated[i]->translation - truth[i]->translation).norm();
  }
  return {{"estimated", poseList(estimated, step)},
          {"true", poseList(truth, step)},
          {"error_m", numberList(error, 6, step)}};
}

Json objectJson(const RunFolder& run, const RunFolderObject& object, const Display& display,
                size_t step) {
  Json held = Json::array(), ellipsoids = Json::array();
  for (size_t i = 0; i < run.frames.size(); i += step) {
    held.push_back(object.held[i] ? Json(*object.held[i] ? 1 : 0) : Json());
    ellipsoids.push_back(object.covariance[i] ? ellipsoidJson(*object.covariance[i]) : Json());
  }
  PerFrame<SE3> truth(run.frames.size());
  if (display.truth) truth = product(run.T_world_camera_true, object.T_camera_object_true);
  Json json = {
      {"name", object.name},
      {"mesh", run.models.is_object() && run.models.contains(object.name) ? run.models[object.name]
                                                                          : Json()},
      {"estimated", poseList(product(carriers(run, display), object.T_camera_object), step)},
      {"true", poseList(truth, step)},
      {"error_m", numberList(object.error_m, 6, step)},
      {"error_rad", numberList(object.error_rad, 6, step)},
      {"held", held},
      {"health", numberList(object.health, 3, step)},
      {"visible", numberList(object.visible, 4, step)},
      {"ellipsoid", ellipsoids},
      {"map", nullptr}};
  if (object.T_world_object && object.map_covariance)
    json["map"] = {{"pose", poseJson(display.T_shown_estimate * *object.T_world_object)},
                   {"ellipsoid", ellipsoidJson(*object.map_covariance)}};
  return json;
}

// With the end of one that was repeated.
std::string reasonOf(const RunFolderEvent& event) {
  if (event.frames < 2) return event.reason;
  const double until_s = 1e-9 * static_cast<double>(event.until_ns);
  return event.reason + " (" + std::to_string(event.frames) + " frames, until " +
         formatFixed(until_s, 2) + " s)";
}

Json eventsJson(const RunFolder& run) {
  Json list = Json::array();
  for (const RunFolderEvent& event : run.events)
    list.push_back({{"t_s", decimals(1e-9 * static_cast<double>(event.timestamp_ns), 6)},
                    {"source", event.source},
                    {"event", event.event},
                    {"value", event.value},
                    {"reason", reasonOf(event)}});
  return list;
}

struct Worst {
  size_t frame = 0, object = 0;
  double error_m = 0;
};

std::vector<Worst> worstFrames(const RunFolder& run) {
  std::vector<Worst> all, picked;
  for (size_t k = 0; k < run.objects.size(); ++k)
    for (size_t i = 0; i < run.frames.size(); ++i)
      if (run.objects[k].error_m[i]) all.push_back({i, k, *run.objects[k].error_m[i]});
  std::stable_sort(all.begin(), all.end(),
                   [](const Worst& a, const Worst& b) { return a.error_m > b.error_m; });
  for (const Worst& worst : all) {
    if (picked.size() == kWorstFrames) break;
    const bool near = std::any_of(picked.begin(), picked.end(), [&](const Worst& other) {
      return std::abs(run.frames[worst.frame] - run.frames[other.frame]) < kWorstGap_frames;
    });
    if (!near) picked.push_back(worst);
  }
  return picked;
}

Json worstJson(const RunFolder& run) {
  const std::vector<Worst> worst = worstFrames(run);
  std::vector<size_t> positions;
  for (const Worst& w : worst) positions.push_back(w.frame);
  const std::vector<std::string> pictures =
      videoFrames(run.path / "overlay.mp4", positions, {.width = 400, .jpeg_quality = 78});
  Json list = Json::array();
  for (size_t i = 0; i < worst.size(); ++i)
    list.push_back(
        {{"frame", run.frames[worst[i].frame]},
         {"t_s", 1e-9 * static_cast<double>(run.times_ns[worst[i].frame])},
         {"object", run.objects[worst[i].object].name},
         {"error_m", worst[i].error_m},
         {"picture",
          pictures[i].empty() ? Json() : Json("data:image/jpeg;base64," + base64(pictures[i]))}});
  return list;
}

Json runJson(const RunFolder& run) {
  const size_t step = (run.frames.size() + kMaxFrames - 1) / kMaxFrames + (run.frames.empty());
  const Display display = displayOf(run);
  Json frames = Json::array(), times = Json::array(), objects = Json::array(),
       points = Json::array();
  for (size_t i = 0; i < run.frames.size(); i += step) {
    frames.push_back(run.frames[i]);
    times.push_back(decimals(1e-9 * static_cast<double>(run.times_ns[i]), 6));
  }
  for (const RunFolderObject& object : run.objects)
    objects.push_back(objectJson(run, object, display, step));
  for (size_t i = 0; i + 2 < run.points.size(); i += 3) {
    const Vector3d p =
        display.T_shown_estimate * Vector3d(run.points[i], run.points[i + 1], run.points[i + 2]);
    for (int k = 0; k < 3; ++k) points.push_back(decimals(p[k], 4));
  }
  return {{"name", run.path.filename().empty() ? run.path.parent_path().filename().string()
                                               : run.path.filename().string()},
          {"metrics", run.metrics},
          {"command", run.command},
          {"verdict", run.verdict},
          {"options", optionList(run.recipe)},
          {"world", display.truth ? "truth" : "estimate"},
          {"frame", frames},
          {"t_s", times},
          {"video_step", step},
          {"camera", cameraJson(run, display, step)},
          {"objects", objects},
          {"odometry", {{"health", numberList(run.odometry_health, 3, step)}}},
          {"timing",
           {{"odometry_ms", numberList(run.odometry_ms, 2, step)},
            {"tracker_ms", numberList(run.tracker_ms, 2, step)},
            {"mapper_ms", numberList(run.mapper_ms, 2, step)}}},
          {"events", eventsJson(run)},
          {"worst", worstJson(run)},
          {"points", points}};
}

std::string videoOf(const fs::path& run) {
  std::error_code error;
  const fs::path file = run / "overlay.mp4";
  const uintmax_t size = fs::file_size(file, error);
  return error || size > kMaxVideo_bytes ? "" : readFile(file);
}

}  // namespace

bool isRunFolder(const fs::path& folder) { return fs::exists(folder / "metrics.json"); }

void writeRunReport(const std::vector<fs::path>& folders, const fs::path& output) {
  ReportContent content;
  Json runs = Json::array();
  for (const fs::path& folder : folders) {
    const RunFolder run = readRunFolder(folder);
    try {
      runs.push_back(runJson(run));
      content.title += (content.title.empty() ? "" : " / ") + run.metrics.value("scene", "run") +
                       ", " + run.metrics.value("method", "");
    } catch (const nlohmann::json::exception& error) {
      throw InputError(folder / "metrics.json", std::string("is none of a run: ") + error.what());
    }
    content.videos.push_back(videoOf(folder));
  }
  content.data = Json{{"kind", "run"}, {"version", DIORAMA_VERSION}, {"runs", runs}}.dump(
      -1, ' ', false, Json::error_handler_t::replace);
  writeFileAtomically(output, reportPage(content));
}

}  // namespace diorama
