#include "vo/initialisation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>

#include "vo/bundle_adjustment.h"
#include "vo/corners.h"
#include "vo/epipolar_search.h"
#include "vo/feature_alignment.h"
#include "vo/object_scale.h"
#include "vo/reprojection.h"
#include "vo/start_trial.h"

namespace diorama::vo {
namespace {

constexpr int kCoarsest = 3;     // pyramid level from which corners are followed
constexpr double kReachPx = 8;   // of a corner from frame to frame, at each level
constexpr double kRayGapPx = 4;  // between two rays that meet in a point; poses are not exact yet
constexpr double kWorstScale = 0.2;  // relative sigma of a baseline that is of any use
constexpr int kCorners = 300;        // more than features, since some will be lost
// Small images have few cells, and never more features: this share of them is enough.
constexpr double kFewestOfCells = 0.25;
constexpr double kBetween =
    0.2;  // of the disparity that starts, from one frame between to the next
constexpr size_t kMostBetween = 4;
constexpr size_t kSeveralFrames = 4;
constexpr double kCloselyPx = 0.5;  // at the corner's level, rms
constexpr double kFewestAgreeThroughout = 0.3;

// Px at the levels where it was seen.
double reprojectionRms(const Camera& camera, const MapPoint& point) {
  double sum = 0;
  for (const Observation& o : point.observations) {
    const auto u = camera.project(o.keyframe->T_world_camera.inverse() * point.p_world);
    if (!u) return std::numeric_limits<double>::infinity();
    sum += std::pow(o.errorPx(o.u_px - *u), 2);
  }
  return std::sqrt(sum / static_cast<double>(point.observations.size()));
}

// Whether the keyframes are where the objects have them.
bool objectsAgree(const Map& map) {
  return std::all_of(map.keyframes.begin(), map.keyframes.end(), [&](const auto& keyframe) {
    const auto d = discrepancy(map, *keyframe);
    return !d || !contradicts(*d);
  });
}

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
  between_.clear();
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

// In the first camera, when its rays meet in front of both.
std::optional<Vector3d> Initialisation::meetingPoint(const FollowedCorner& corner,
                                                     const SE3& T_second_first) const {
  const auto bearing = camera_.unproject(corner.u_px);
  const auto point =
      bearing ? triangulate(T_second_first, corner.bearing_first, *bearing) : std::nullopt;
  const double focal = 0.5 * (camera_.fx() + camera_.fy());
  if (!point || point->error * focal > kRayGapPx) return std::nullopt;
  return corner.bearing_first / point->inverse_depth;
}

std::ptrdiff_t Initialisation::countPoints(const SE3& T_first_second) const {
  const SE3 T_second_first = T_first_second.inverse();
  return std::count_if(corners_.begin(), corners_.end(), [&](const FollowedCorner& corner) {
    return meetingPoint(corner, T_second_first).has_value();
  });
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

std::vector<Initialisation::StartPoint> Initialisation::addPoints(const SE3& T_first_second,
                                                                  Keyframe& first, Map& map) const {
  const SE3 T_second_first = T_first_second.inverse();
  std::vector<StartPoint> added;
  for (const FollowedCorner& c : corners_)
    if (const auto p_first = meetingPoint(c, T_second_first))
      added.push_back(
          {&c, &map.addPoint(first, *p_first, hostMeasurement(c.u_first_px, c.level, options_))});
  return added;
}

// Of those that objects tell, that under which most points are seen where their corners were.
std::optional<SE3> Initialisation::poseBetween(size_t k, std::span<const StartPoint> points) const {
  std::optional<SE3> best;
  std::ptrdiff_t most = -1;
  for (const SE3& T_first_k : motionsOfObjects(between_[k].objects)) {
    const SE3 T_k_first = T_first_k.inverse();
    const auto agree = std::count_if(points.begin(), points.end(), [&](const StartPoint& p) {
      const auto u = camera_.project(T_k_first * p.point->p_world);
      return u && (*u - p.corner->between[k].u_px).norm() < kRayGapPx;
    });
    if (agree <= most) continue;
    most = agree;
    best = T_first_k;
  }
  return best;
}

void Initialisation::fillMap(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects,
                             const SE3& T_first_second, bool with_between, Map& map) const {
  Keyframe& first = map.addKeyframe(first_);
  attachObjects(map, first, objects_, options_);
  const std::vector<StartPoint> points = addPoints(T_first_second, first, map);
  const auto add = [&](TrackedFrame keyframe, const SE3& T_world_camera, const auto& measured,
                       std::span<const ObjectMeasurement> seen) {
    keyframe.T_world_camera = T_world_camera;
    keyframe.features.clear();
    for (const StartPoint& p : points) keyframe.features.push_back({measured(*p.corner), p.point});
    attachObjects(map, map.addKeyframe(keyframe), seen, options_);
  };
  const size_t count = with_between ? std::min(between_.size(), kMostBetween) : 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t k = i * between_.size() / count;
    const auto measured = [k](const FollowedCorner& c) { return c.between[k]; };
    if (const auto T_first_k = poseBetween(k, points))
      add(between_[k].frame, *T_first_k, measured, between_[k].objects);
  }
  add(
      frame, T_first_second, [](const FollowedCorner& c) { return c.measured; }, objects);
}

// Twice, for then they are measured again by patches warped with the better poses.
void Initialisation::adjust(bool metric, Map& map) const {
  constexpr int kIterations = 20;
  const int window = static_cast<int>(map.keyframes.size());
  adjustBundle(camera_, map, {window, kIterations, metric}, options_);
  map.removeBadPoints();
  for (const auto& point : map.points) point->observations.resize(1);
  for (size_t i = 1; i < map.keyframes.size(); ++i) {
    Keyframe& keyframe = *map.keyframes[i];
    measureAll(camera_, map, keyframe, options_);
    for (const Feature& feature : keyframe.features)
      feature.point->observations.push_back({feature, &keyframe});
  }
  adjustBundle(camera_, map, {window, kIterations, metric}, options_);
  map.removeBadPoints();
}

bool Initialisation::mostAgree(const Map& map) const {
  return static_cast<double>(map.keyframes.back()->features.size()) >=
         kFewestAgree * static_cast<double>(corners_.size());
}

// Corners that are not on objects and agree with their motion over several frames, closely, are of
// the world that the objects rest in, though there be fewer: the others are on what moves.
bool Initialisation::enoughAgreeThroughout(const Map& map) const {
  if (map.keyframes.size() < kSeveralFrames || !surfaces_.know(objects_)) return false;
  const auto isOff = [&](const Vector2d& u_px, int level) {
    return !surfaces_.touch(camera_, u_px, level, objects_);
  };
  const auto agree = std::count_if(map.points.begin(), map.points.end(), [&](const auto& point) {
    const Observation& first = point->observations.front();
    return point->observations.size() >= kSeveralFrames && isOff(first.u_px, first.level) &&
           reprojectionRms(camera_, *point) < kCloselyPx;
  });
  const auto off = std::count_if(corners_.begin(), corners_.end(), [&](const FollowedCorner& c) {
    return isOff(c.u_first_px, c.level);
  });
  return agree >= fewestPoints() &&
         static_cast<double>(agree) >= kFewestAgreeThroughout * static_cast<double>(off);
}

// Frames far enough from one another in the image to say something.
void Initialisation::keepBetween(const TrackedFrame& frame,
                                 std::span<const ObjectMeasurement> objects) {
  if (corners_.empty() || motionsOfObjects(objects).empty()) return;
  std::vector<double> lengths;
  for (const FollowedCorner& c : corners_)
    lengths.push_back((c.u_px - (c.between.empty() ? c.u_first_px : c.between.back().u_px)).norm());
  if (median(std::move(lengths)) < kBetween * options_.start_disparity_px) return;
  between_.push_back({frame, {objects.begin(), objects.end()}});
  for (FollowedCorner& c : corners_) c.between.push_back(c.measured);
}

StartAttempt Initialisation::tryStart(const TrackedFrame& frame,
                                      std::span<const ObjectMeasurement> objects,
                                      bool without_scale, Map& map) {
  StartAttempt attempt;
  if (!hopeless().empty() || frames_ == 0) return attempt;
  if (hasParallax(objects)) {
    attempt = startFrom(frame, objects, without_scale, false, map);
    if (!attempt.started && !between_.empty()) {
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
  fillMap(frame, objects, *motion, with_between && attempt.metric, map);
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
  adjust(attempt.metric, map);
  attempt.points = static_cast<int>(second.features.size());
  if (attempt.points < fewestPoints()) return fail("too few points are seen twice");
  if (with_between ? !enoughAgreeThroughout(map) : !mostAgree(map))
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
