#include "vo/initialisation.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "vo/bundle_adjustment.h"
#include "vo/corners.h"
#include "vo/epipolar_search.h"
#include "vo/feature_alignment.h"
#include "vo/object_scale.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr int kCoarsest = 3;     // pyramid level from which corners are followed
constexpr double kReachPx = 8;   // of a corner from frame to frame, at each level
constexpr double kRayGapPx = 4;  // between two rays that meet in a point; poses are not exact yet
constexpr double kWorstScale = 0.2;  // relative sigma of a baseline that is of any use
constexpr int kCorners = 300;        // more than features, since some will be lost
// Small images have few cells, and never more features: this share of them is enough.
constexpr double kFewestOfCells = 0.25;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void Initialisation::begin(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects) {
  first_ = frame;
  first_.T_world_camera = SE3{};
  first_.features.clear();
  objects_.assign(objects.begin(), objects.end());
  corners_.clear();
  frames_ = 0;
  const CellGrid grid(camera_.width(), camera_.height(), options_.cell_px);
  const std::vector<uint8_t> occupied(grid.size(), 0);
  for (const Corner& corner :
       detectCorners(*frame.pyramid, frame.noise, grid, occupied, kCorners, options_)) {
    const auto bearing = camera_.unproject(corner.u_px);
    if (!bearing) continue;
    FollowedCorner followed{corner.u_px, corner.u_px, *bearing, corner.level, {}, {}};
    for (int l = corner.level; l <= std::min(kCoarsest, frame.pyramid->levels() - 1); ++l)
      if (const auto patch = cutPatch(*frame.pyramid, corner.u_px, l))
        followed.patches.push_back(*patch);
    if (!followed.patches.empty()) corners_.push_back(std::move(followed));
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
    if (i == 0) return found && found->rms <= 2 * largestPatchRms(first_.noise, options_);
  }
  return false;
}

bool Initialisation::sawObject() const {
  return std::any_of(objects_.begin(), objects_.end(), isUsable);
}

void Initialisation::follow(const TrackedFrame& frame) {
  ++frames_;
  std::erase_if(corners_, [&](FollowedCorner& c) { return !followCorner(*frame.pyramid, c); });
}

int Initialisation::fewestPoints() const {
  const CellGrid grid(camera_.width(), camera_.height(), options_.cell_px);
  return std::min(options_.start_min_points,
                  static_cast<int>(kFewestOfCells * static_cast<double>(grid.size())));
}

std::string Initialisation::hopeless() const {
  if (static_cast<int>(corners_.size()) < fewestPoints())
    return frames_ == 0 ? "the image has hardly a corner"
                        : "most corners of the first keyframe are lost";
  if (frames_ >= options_.start_window_frames) return "the camera has hardly moved sideways";
  return "";
}

double Initialisation::medianDisparity(const Eigen::Quaterniond& R_second_first) const {
  std::vector<double> lengths;
  for (const FollowedCorner& c : corners_)
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
  for (const SE3& motion : motionsOfObjects(objects))
    if (medianDisparity(motion.rotation.conjugate()) >= enough_px) return true;
  return false;
}

std::vector<SE3> Initialisation::motionsOfObjects(
    std::span<const ObjectMeasurement> objects) const {
  std::vector<SE3> motions;
  for (const ObjectMeasurement& now : objects)
    for (const ObjectMeasurement& then : objects_)
      if (now.object == then.object && isUsable(now) && isUsable(then))
        motions.push_back(then.T_camera_object * now.T_camera_object.inverse());
  return motions;
}

// Corners whose rays meet in front of both cameras.
int Initialisation::countPoints(const SE3& T_first_second) const {
  const SE3 T_second_first = T_first_second.inverse();
  const double focal = 0.5 * (camera_.fx() + camera_.fy());
  int count = 0;
  for (const FollowedCorner& c : corners_) {
    const auto bearing = camera_.unproject(c.u_px);
    const auto point =
        bearing ? triangulate(T_second_first, c.bearing_first, *bearing) : std::nullopt;
    count += point && point->error * focal < kRayGapPx;
  }
  return count;
}

// Each object seen in both frames tells a motion by itself, and the length of the one that the
// corners tell; taken is the motion under which most corners make sense.
std::optional<SE3> Initialisation::metricMotion(std::span<const ObjectMeasurement> objects,
                                                const std::optional<SE3>& from_corners,
                                                std::string& source) const {
  std::vector<SE3> motions = motionsOfObjects(objects);
  double length = 0, weights = 0;
  for (const ObjectMeasurement& now : objects)
    for (const ObjectMeasurement& then : objects_) {
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
  int most = -1;
  for (const SE3& motion : motions)
    if (const int count = countPoints(motion); count > most) {
      most = count;
      best = motion;
    }
  return best;
}

// Five points in RANSAC (Nister 2004); the length of the baseline is arbitrary.
std::optional<SE3> Initialisation::motionFromCorners() const {
  std::vector<cv::Point2d> first, second;
  for (const FollowedCorner& c : corners_) {
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

void Initialisation::fillMap(const TrackedFrame& frame, const SE3& T_first_second, Map& map) const {
  TrackedFrame second = frame;
  second.T_world_camera = T_first_second;
  second.features.clear();
  Keyframe& a = map.addKeyframe(first_);
  Keyframe& b = map.addKeyframe(second);
  const SE3 T_second_first = T_first_second.inverse();
  const double focal = 0.5 * (camera_.fx() + camera_.fy());
  for (const FollowedCorner& c : corners_) {
    const auto bearing = camera_.unproject(c.u_px);
    const auto point =
        bearing ? triangulate(T_second_first, c.bearing_first, *bearing) : std::nullopt;
    if (!point || point->error * focal > kRayGapPx) continue;
    MapPoint& added = map.addPoint(a, c.bearing_first / point->inverse_depth,
                                   hostMeasurement(c.u_first_px, c.level, options_));
    added.observations.push_back({c.measured, &b});
    b.features.push_back({c.measured, &added});
  }
}

StartAttempt Initialisation::tryStart(const TrackedFrame& frame,
                                      std::span<const ObjectMeasurement> objects,
                                      bool without_scale, Map& map) const {
  StartAttempt attempt;
  if (!hopeless().empty() || frames_ == 0) return attempt;
  if (!hasParallax(objects)) return attempt;
  std::string source;
  const std::optional<SE3> from_corners = motionFromCorners();
  std::optional<SE3> motion = metricMotion(objects, from_corners, source);
  attempt.metric = motion.has_value();
  if (!motion && without_scale) motion = from_corners;
  if (!motion) {
    attempt.reason =
        without_scale ? "no motion explains the corners" : "no object was seen in both keyframes";
    return attempt;
  }
  fillMap(frame, *motion, map);
  Keyframe &a = *map.keyframes.front(), &b = *map.keyframes.back();
  const auto fail = [&](const std::string& reason) {
    map.clear();
    attempt.reason = reason;
    return attempt;
  };
  if (static_cast<int>(b.features.size()) < fewestPoints())
    return fail("too few corners agree with the camera's motion");
  if (b.T_world_camera.translation.norm() < options_.start_baseline_rad * depthRange(b).median_m)
    return fail("the camera has hardly moved sideways");
  attachObjects(map, a, objects_, options_);
  attachObjects(map, b, objects, options_);
  if (!attempt.metric) normaliseDepth(map);

  constexpr int kIterations = 20;
  adjustBundle(camera_, map, {2, kIterations, attempt.metric}, options_);
  map.removeBadPoints();
  // Measured again by patches warped with the better poses.
  for (const auto& point : map.points) point->observations.resize(1);
  measureAll(camera_, map, b, options_);
  for (const Feature& feature : b.features) feature.point->observations.push_back({feature, &b});
  adjustBundle(camera_, map, {2, kIterations, attempt.metric}, options_);
  map.removeBadPoints();
  attempt.points = static_cast<int>(b.features.size());
  if (attempt.points < fewestPoints()) return fail("too few points are seen twice");
  if (attempt.points < kFewestAgree * static_cast<double>(corners_.size()))
    return fail("many corners do not move as the camera's motion says; does the object move?");
  if (attempt.metric && scaleSigma(map) > kWorstScale)
    return fail("the objects do not tell the baseline well enough");
  attempt.started = true;
  b.tracked = b.features.size();
  attempt.reason = attempt.metric ? "scale from " + source
                                  : "scale unknown: no object was seen in both keyframes";
  return attempt;
}

}  // namespace diorama::vo
