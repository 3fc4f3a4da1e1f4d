#include "mapper/motion_watch.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "mapper/landmarks.h"

namespace diorama {
namespace {

constexpr size_t kFewestSights = 6;  // of a window, which else says nothing about its way

double seconds(int64_t from_ns, int64_t to_ns) {
  return 1e-9 * static_cast<double>(to_ns - from_ns);
}

double trace(const Matrix6d& covariance, int first) {
  return covariance.block<3, 3>(first, first).trace();
}

}  // namespace

void MotionWatch::setSymmetries(const std::string& object, const Symmetries& symmetries) {
  objects_[object].symmetries = symmetries;
}

void MotionWatch::start(int64_t timestamp_ns) {
  for (auto& [name, object] : objects_) {
    Watched fresh;
    fresh.symmetries = std::move(object.symmetries);
    object = std::move(fresh);
  }
  breakOff(timestamp_ns);
}

void MotionWatch::addStep(const OdometryMeasurement& step) {
  DIORAMA_CHECK(!path_.empty());
  Camera next = path_.back();
  next.timestamp_ns = step.to_ns;
  next.T_world_camera = next.T_world_camera * step.T_from_to;
  next.variance_m2 += trace(step.covariance, 0);
  next.variance_rad2 += trace(step.covariance, 3);
  path_.push_back(next);
  const double kept_s = std::max(options_.window_s, options_.rest_s);
  while (seconds(path_.front().timestamp_ns, step.to_ns) > 2 * kept_s) path_.pop_front();
}

void MotionWatch::breakOff(int64_t timestamp_ns) {
  path_.assign(1, Camera{});
  path_.front().timestamp_ns = timestamp_ns;
  for (auto& [name, object] : objects_) {
    object.sights.clear();
    object.way.reset();
    object.displaced_frames = 0;
  }
}

const MotionWatch::Camera* MotionWatch::cameraAt(int64_t timestamp_ns) const {
  for (auto camera = path_.rbegin(); camera != path_.rend(); ++camera)
    if (camera->timestamp_ns == timestamp_ns) return &*camera;
  return nullptr;
}

void MotionWatch::addSight(const ObjectMeasurement& measurement) {
  const Camera* camera = cameraAt(measurement.timestamp_ns);
  Watched& object = objects_[measurement.object];
  std::deque<Sight>& sights = object.sights;
  if (!camera) return;
  if (!sights.empty() && sights.back().camera.timestamp_ns >= measurement.timestamp_ns) return;
  Sight sight{*camera, measurement, {}};
  if (!sights.empty()) {
    const SE3 expected = camera->T_world_camera.inverse() * sights.back().T_world_object;
    const ObjectFactor nearest =
        nearestBySymmetry({0, measurement.T_camera_object, {}}, expected, object.symmetries);
    sight.measurement.T_camera_object = nearest.Z;
  }
  sight.T_world_object = camera->T_world_camera * sight.measurement.T_camera_object;
  sights.push_back(std::move(sight));
  const double kept_s = std::max(options_.window_s, options_.rest_s);
  while (seconds(sights.front().camera.timestamp_ns, measurement.timestamp_ns) > 1.5 * kept_s)
    sights.pop_front();
  object.way = wayInWindow(object);
  const bool displaced = isDisplaced(object);
  object.displaced_frames = displaced ? object.displaced_frames + 1 : 0;
  if (displaced || object.moving) return;
  object.health_sum += measurement.health;
  ++object.health_count;
}

// The newest sights that make up a time; all of them when they do not.
size_t MotionWatch::windowBegin(const Watched& object, double length_s) const {
  const int64_t now_ns = object.sights.back().camera.timestamp_ns;
  constexpr double kTolerance_s = 1e-3;  // of time stamps
  size_t begin = 0;
  while (seconds(object.sights[begin].camera.timestamp_ns, now_ns) > length_s + kTolerance_s)
    ++begin;
  return begin;
}

MotionWatch::Way MotionWatch::wayBetween(const Sight& a, const Sight& b) {
  const auto variance = [&](int first) {
    return trace(a.measurement.covariance, first) + trace(b.measurement.covariance, first);
  };
  const double turned = std::abs(b.camera.variance_rad2 - a.camera.variance_rad2);
  const double distance = b.measurement.T_camera_object.translation.norm();
  return {(b.T_world_object.translation - a.T_world_object.translation).norm(),
          angleBetween(a.T_world_object.rotation, b.T_world_object.rotation),
          std::sqrt(variance(0) + std::abs(b.camera.variance_m2 - a.camera.variance_m2) +
                    distance * distance * turned),
          std::sqrt(variance(3) + turned),
          (b.camera.T_world_camera.translation - a.camera.T_world_camera.translation).norm()};
}

std::optional<MotionWatch::Way> MotionWatch::wayInWindow(const Watched& object) const {
  const size_t begin = windowBegin(object, options_.window_s);
  if (object.sights.size() - begin < kFewestSights) return std::nullopt;
  return wayBetween(object.sights[begin], object.sights.back());
}

bool MotionWatch::isDisplaced(const Watched& object) const {
  if (!object.way) return false;
  const auto is = [&](double way, double sigma, double least) {
    return way > least && way > options_.sigmas * sigma;
  };
  const double by_scale_m = options_.odometry_scale * object.way->camera_m;
  const bool shifted =
      is(object.way->m, std::hypot(object.way->sigma_m, by_scale_m), options_.least_m);
  const bool turned = is(object.way->rad, object.way->sigma_rad, options_.least_rad);
  if (!shifted && !turned) return false;
  const std::deque<Sight>& sights = object.sights;
  const size_t begin = windowBegin(object, options_.window_s);
  const double usual = object.health_count > 0 ? object.health_sum / object.health_count
                                               : sights[begin].measurement.health;
  double step_m = 0, step_rad = 0;
  for (size_t k = begin; k < sights.size(); ++k) {
    if (sights[k].measurement.health < options_.health_share * usual) return false;
    if (k == begin) continue;
    const Way way = wayBetween(sights[k - 1], sights[k]);
    step_m = std::max(step_m, way.m);
    step_rad = std::max(step_rad, way.rad);
  }
  return (shifted && step_m < options_.largest_step * object.way->m) ||
         (turned && step_rad < options_.largest_step * object.way->rad);
}

// Nothing that is seen beside it goes less than half as far.
bool MotionWatch::mayBeTheCamera(const std::string& name) const {
  const Watched& mover = objects_.at(name);
  const int64_t now_ns = mover.sights.back().camera.timestamp_ns;
  bool alone = true;
  for (const auto& [other, object] : objects_) {
    if (other == name || object.moving || !object.way) continue;
    if (seconds(object.sights.back().camera.timestamp_ns, now_ns) > options_.window_s) continue;
    if (object.way->m < 0.5 * mover.way->m &&
        object.way->rad < std::max(0.5 * mover.way->rad, options_.least_rad))
      return false;
    alone = false;
  }
  return !alone;
}

bool MotionWatch::moves(const std::string& name) const {
  const auto found = objects_.find(name);
  return options_.watch && found != objects_.end() &&
         found->second.displaced_frames >= options_.frames && !mayBeTheCamera(name);
}

bool MotionWatch::rests(const std::string& name) const {
  const auto found = objects_.find(name);
  if (found == objects_.end() || found->second.sights.empty()) return false;
  const std::deque<Sight>& sights = found->second.sights;
  const size_t begin = windowBegin(found->second, options_.rest_s);
  const Sight& last = sights.back();
  constexpr double kWhole = 0.9;  // of the time, since frames do not come at its ends
  if (sights.size() - begin < kFewestSights ||
      seconds(sights[begin].camera.timestamp_ns, last.camera.timestamp_ns) <
          kWhole * options_.rest_s)
    return false;
  return std::all_of(sights.begin() + static_cast<std::ptrdiff_t>(begin), sights.end(),
                     [&](const Sight& sight) {
                       const Way way = wayBetween(sight, last);
                       return way.m < options_.rest_m + 2 * way.sigma_m &&
                              way.rad < options_.rest_rad + 2 * way.sigma_rad;
                     });
}

void MotionWatch::setMoving(const std::string& object, bool moving) {
  objects_[object].moving = moving;
  objects_[object].displaced_frames = 0;
}

std::vector<ObjectMeasurement> MotionWatch::window(const std::string& name) const {
  std::vector<ObjectMeasurement> measurements;
  const auto found = objects_.find(name);
  if (found == objects_.end() || found->second.sights.empty()) return measurements;
  const std::deque<Sight>& sights = found->second.sights;
  for (size_t k = windowBegin(found->second, options_.window_s); k < sights.size(); ++k)
    measurements.push_back(sights[k].measurement);
  return measurements;
}

}  // namespace diorama
