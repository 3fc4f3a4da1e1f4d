#include "vo/initialisation.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "vo/corners.h"
#include "vo/feature_alignment.h"
#include "vo/object_scale.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr int kCoarsest = 3;         // pyramid level from which corners are followed
constexpr double kReachPx = 8;       // of a corner from frame to frame, at each level
constexpr double kWorstScale = 0.2;  // relative sigma of a baseline that is of any use
constexpr int kCorners = 300;        // more than features, since some will be lost
// Small images have few cells, and never more features: this share of them is enough.
constexpr double kFewestOfCells = 0.25;
constexpr double kBetween =
    0.2;  // of the disparity that starts, from one frame between to the next

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void Initialisation::begin(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects) {
  followed_.first = frame;
  followed_.first.T_world_camera = SE3{};
  followed_.first.features.clear();
  followed_.objects.assign(objects.begin(), objects.end());
  followed_.corners.clear();
  followed_.between.clear();
  contradicted_ = false;
  frames_ = 0;
  const CellGrid grid(camera_.width(), camera_.height(), options_.cell_px);
  const std::vector<uint8_t> occupied(grid.size(), 0);
  for (const Corner& corner :
       detectCorners(*frame.pyramid, frame.noise, grid, occupied, kCorners, options_)) {
    const auto bearing = camera_.unproject(corner.u_px);
    if (!bearing) continue;
    FollowedCorner followed{corner.u_px, corner.u_px, *bearing, corner.level, {}, {}, {}};
    for (int l = corner.level; l <= std::min(kCoarsest, frame.pyramid->levels() - 1); ++l)
      if (const auto patch = cutPatch(*frame.pyramid, corner.u_px, l))
        followed.patches.push_back(*patch);
    if (!followed.patches.empty()) followed_.corners.push_back(std::move(followed));
  }
}

// Coarse to fine from where it was; a level that fails is passed over, but the finest must agree.
bool Initialisation::followCorner(const ImagePyramid& pyramid, FollowedCorner& corner) const {
  for (size_t i = corner.patches.size(); i-- > 0;) {
    const Patch& patch = corner.patches[i];
    const auto found = alignFeature(pyramid.level(patch.level), patch,
                                    toLevel(corner.u_px, patch.level), kReachPx, true);
    if (found) corner.measured = measuredBy(*found, patch.level, options_);
    if (found) corner.u_px = corner.measured.u_px;
    if (i == 0) return found && found->rms <= 2 * largestPatchRms(followed_.first.noise, options_);
  }
  return false;
}

bool Initialisation::sawObject() const {
  return std::any_of(followed_.objects.begin(), followed_.objects.end(), isUsable);
}

void Initialisation::follow(const TrackedFrame& frame) {
  ++frames_;
  std::erase_if(followed_.corners,
                [&](FollowedCorner& c) { return !followCorner(*frame.pyramid, c); });
}

int Initialisation::fewestPoints() const {
  const CellGrid grid(camera_.width(), camera_.height(), options_.cell_px);
  return std::min(options_.start_min_points,
                  static_cast<int>(kFewestOfCells * static_cast<double>(grid.size())));
}

std::string Initialisation::hopeless() const {
  if (static_cast<int>(followed_.corners.size()) < fewestPoints())
    return frames_ == 0 ? "the image has hardly a corner"
                        : "most corners of the first keyframe are lost";
  if (frames_ >= options_.start_window_frames) return "the camera has hardly moved sideways";
  return "";
}

double Initialisation::medianDisparity(const Eigen::Quaterniond& R_second_first) const {
  std::vector<double> lengths;
  for (const FollowedCorner& c : followed_.corners)
    if (const auto turned = camera_.project(R_second_first * c.bearing_first))
      lengths.push_back((c.u_px - *turned).norm());
  return lengths.empty() ? 0 : median(std::move(lengths));
}

double Initialisation::motionInImage() const {
  return medianDisparity(Eigen::Quaterniond::Identity());
}

// A camera that turns against its motion keeps what it looks at in place: objects that say how it
// turned show the parallax that is left. But where nothing moves in the image, it is the object
// that does.
bool Initialisation::hasParallax(std::span<const ObjectMeasurement> objects) const {
  const double enough_px = parallax_ * options_.start_disparity_px;
  if (motionInImage() >= enough_px) return true;
  if (motionInImage() < kSmallestMotion * enough_px) return false;
  for (const SE3& motion : motionsOfObjects(followed_.objects, objects))
    if (medianDisparity(motion.rotation.conjugate()) >= enough_px) return true;
  return false;
}

std::ptrdiff_t Initialisation::countPoints(const SE3& T_first_second) const {
  const SE3 T_second_first = T_first_second.inverse();
  return std::count_if(followed_.corners.begin(), followed_.corners.end(),
                       [&](const FollowedCorner& corner) {
                         return meetingPoint(camera_, corner, T_second_first).has_value();
                       });
}

// Each object seen in both frames tells a motion by itself, and the length of the one that the
// corners tell; taken is the motion under which most corners make sense.
std::optional<SE3> Initialisation::metricMotion(std::span<const ObjectMeasurement> objects,
                                                const std::optional<SE3>& from_corners,
                                                std::string& source) const {
  std::vector<SE3> motions = motionsOfObjects(followed_.objects, objects);
  double length = 0, weights = 0;
  for (const ObjectMeasurement& now : objects)
    for (const ObjectMeasurement& then : followed_.objects) {
      if (now.object != then.object || !isUsable(now) || !isUsable(then)) continue;
      source += (source.empty() ? "" : ", ") + now.object;
      if (!from_corners) continue;
      const double weight =
          1 /
          (then.covariance.topLeftCorner<3, 3>() + now.covariance.topLeftCorner<3, 3>()).trace();
      length += weight * pathOfObject(*from_corners, then.T_camera_object, now.T_camera_object)
                             .dot(from_corners->translation.normalized());
      weights += weight;
    }
  if (length > 0) {
    const Vector3d t = from_corners->translation.normalized() * (length / weights);
    motions.push_back({from_corners->rotation, t});
  }
  std::optional<SE3> best;
  std::ptrdiff_t most = -1;
  for (const SE3& motion : motions)
    if (const std::ptrdiff_t count = countPoints(motion); count > most) {
      most = count;
      best = motion;
    }
  return best;
}

// Five points in RANSAC (Nister 2004); the length of the baseline is arbitrary.
std::optional<SE3> Initialisation::motionFromCorners() const {
  std::vector<cv::Point2d> first, second;
  for (const FollowedCorner& c : followed_.corners) {
    const auto bearing = camera_.unproject(c.u_px);
    if (!bearing) continue;
    first.emplace_back(c.bearing_first.x(), c.bearing_first.y());
    second.emplace_back(bearing->x(), bearing->y());
  }
  if (static_cast<int>(first.size()) < fewestPoints()) return std::nullopt;
  const double focal = 0.5 * (camera_.fx() + camera_.fy());
  cv::Mat inliers;
  const cv::Mat E = cv::findEssentialMat(first, second, 1.0, cv::Point2d(0, 0), cv::RANSAC, 0.999,
                                         1.0 / focal, inliers);
  if (E.rows != 3 || E.cols != 3) return std::nullopt;
  cv::Mat R, t;
  const int good = cv::recoverPose(E, first, second, R, t, 1.0, cv::Point2d(0, 0), inliers);
  if (good < fewestPoints()) return std::nullopt;
  Eigen::Matrix4d T_second_first = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) T_second_first(i, j) = R.at<double>(i, j);
    T_second_first(i, 3) = t.at<double>(i);
  }
  return SE3::fromMatrix(T_second_first).inverse();
}

namespace {

// Scales the map so that the median depth of its points is 1.
void normaliseDepth(Map& map) {
  const double scale = 1 / depthRange(*map.keyframes.back()).median_m;
  for (const auto& point : map.points) point->p_world *= scale;
  for (const auto& keyframe : map.keyframes) keyframe->T_world_camera.translation *= scale;
}

}  // namespace

// Frames far enough from one another in the image to say something.
void Initialisation::keepBetween(const TrackedFrame& frame,
                                 std::span<const ObjectMeasurement> objects) {
  if (followed_.corners.empty() || motionsOfObjects(followed_.objects, objects).empty()) return;
  std::vector<double> lengths;
  for (const FollowedCorner& c : followed_.corners)
    lengths.push_back((c.u_px - (c.between.empty() ? c.u_first_px : c.between.back().u_px)).norm());
  if (median(std::move(lengths)) < kBetween * options_.start_disparity_px) return;
  followed_.between.push_back({frame, {objects.begin(), objects.end()}});
  for (FollowedCorner& c : followed_.corners) c.between.push_back(c.measured);
}

StartAttempt Initialisation::tryStart(const TrackedFrame& frame,
                                      std::span<const ObjectMeasurement> objects,
                                      bool without_scale, Map& map) {
  StartAttempt attempt;
  if (!hopeless().empty() || frames_ == 0) return attempt;
  if (hasParallax(objects)) {
    attempt = startFrom(frame, objects, without_scale, false, map);
    if (!attempt.started && !followed_.between.empty()) {
      const StartAttempt again = startFrom(frame, objects, without_scale, true, map);
      if (again.started) attempt = again;
    }
  }
  if (!attempt.started) keepBetween(frame, objects);
  return attempt;
}

StartAttempt Initialisation::startFrom(const TrackedFrame& frame,
                                       std::span<const ObjectMeasurement> objects,
                                       bool without_scale, bool with_between, Map& map) {
  StartAttempt attempt;
  std::string source;
  const std::optional<SE3> from_corners = motionFromCorners();
  std::optional<SE3> motion = metricMotion(objects, from_corners, source);
  attempt.metric = motion.has_value();
  if (!motion && without_scale && !contradicted_) motion = from_corners;
  if (!motion) {
    attempt.reason =
        without_scale ? "no motion explains the corners" : "no object was seen in both keyframes";
    return attempt;
  }
  fillMap(camera_, followed_, frame, objects, *motion, with_between && attempt.metric, options_,
          map);
  const Keyframe& second = *map.keyframes.back();
  const auto fail = [&](const std::string& reason) {
    map.clear();
    attempt.reason = reason;
    return attempt;
  };
  if (static_cast<int>(second.features.size()) < fewestPoints())
    return fail("too few corners agree with the camera's motion");
  if (second.T_world_camera.translation.norm() <
      options_.start_baseline_rad * depthRange(second).median_m)
    return fail("the camera has hardly moved sideways");
  if (!attempt.metric) normaliseDepth(map);
  adjustMap(camera_, attempt.metric, options_, map);
  attempt.points = static_cast<int>(second.features.size());
  if (attempt.points < fewestPoints()) return fail("too few points are seen twice");
  const bool most_agree =
      attempt.points >= kFewestAgree * static_cast<double>(followed_.corners.size());
  if (with_between ? !enoughAgreeThroughout(camera_, followed_, surfaces_, fewestPoints(), map)
                   : !most_agree)
    return fail("many corners do not move as the camera's motion says; does the object move?");
  if (attempt.metric && !objectsAgree(map)) {
    contradicted_ = true;
    return fail("the corners do not move as the objects do; does something move with the camera?");
  }
  if (attempt.metric && scaleSigma(map) > kWorstScale)
    return fail("the objects do not tell the baseline well enough");
  attempt.started = true;
  map.keyframes.back()->tracked = second.features.size();
  attempt.reason = attempt.metric ? "scale from " + source
                                  : "scale unknown: no object was seen in both keyframes";
  return attempt;
}

}  // namespace diorama::vo
