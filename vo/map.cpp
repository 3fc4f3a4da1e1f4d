#include "vo/map.h"

#include <algorithm>
#include <cmath>

namespace diorama::vo {

TrackedFrame makeFrame(const Frame& frame, const Camera& camera, const VoOptions& options) {
  TrackedFrame made;
  made.timestamp_ns = frame.timestamp_ns;
  if (frame.gray.width != camera.width() || frame.gray.height != camera.height()) return made;
  made.pyramid = std::make_shared<const ImagePyramid>(frame.gray, options.pyramid_levels);
  made.noise = imageNoise(frame.gray);
  return made;
}

Keyframe& Map::addKeyframe(const TrackedFrame& frame) {
  auto keyframe = std::make_unique<Keyframe>();
  static_cast<TrackedFrame&>(*keyframe) = frame;
  keyframe->id = next_id_++;
  keyframe->tracked = frame.features.size();
  for (const Feature& feature : keyframe->features) {
    feature.point->observations.push_back({feature, keyframe.get()});
    settle(frame, *feature.point);
  }
  keyframes.push_back(std::move(keyframe));
  return *keyframes.back();
}

MapPoint& Map::addPoint(Keyframe& host, const Vector3d& p_world, const Measured& seen) {
  auto point = std::make_unique<MapPoint>();
  point->p_world = p_world;
  point->observations.push_back({seen, &host});
  host.features.push_back({seen, point.get()});
  points.push_back(std::move(point));
  return *points.back();
}

void Map::removeKeyframe(Keyframe& keyframe) {
  for (const Feature& feature : keyframe.features) {
    std::erase_if(feature.point->observations,
                  [&](const Observation& o) { return o.keyframe == &keyframe; });
    if (feature.point->observations.empty()) feature.point->bad = true;
  }
  std::erase_if(keyframes, [&](const auto& k) { return k.get() == &keyframe; });
}

void Map::removeBadPoints() {
  for (const auto& keyframe : keyframes)
    std::erase_if(keyframe->features, [](const Feature& f) { return f.point->bad; });
  std::erase_if(points, [](const auto& p) { return p->bad; });
}

void Map::stretch(const Vector3d& centre, double factor) {
  const auto move = [&](Vector3d& p) { p = centre + factor * (p - centre); };
  for (const auto& point : points) {
    move(point->p_world);
    move(point->assumed_p_world);
    point->covariance *= factor * factor;
    point->assumed_information /= factor * factor;
  }
  for (const auto& keyframe : keyframes) move(keyframe->T_world_camera.translation);
}

size_t Map::objectIndex(const std::string& name) {
  for (size_t i = 0; i < objects.size(); ++i)
    if (objects[i].name == name) return i;
  objects.push_back({name, SE3{}});
  return objects.size() - 1;
}

void Map::clear() {
  points.clear();
  keyframes.clear();
  objects.clear();
}

void judgePoints(const TrackedFrame& frame, const std::vector<MapPoint*>& failed) {
  constexpr int kFailuresAllowed = 15;  // in a row
  constexpr size_t kWellSeen = 4;       // keyframes: such a point may just be covered
  for (MapPoint* point : failed)
    if (++point->failed > kFailuresAllowed && point->observations.size() < kWellSeen)
      point->bad = true;
  for (const Feature& feature : frame.features) {
    ++feature.point->agreed;
    feature.point->failed = 0;
  }
}

void settle(const TrackedFrame& frame, MapPoint& point) {
  if (!point.settled) point.scale_variance = frame.scale_variance;
  point.settled = true;
}

double scaleVariance(const TrackedFrame& frame, const TrackedFrame& before) {
  double common = 0, own = 0, count = 0;
  for (const Feature& feature : frame.features) {
    const MapPoint& point = *feature.point;
    if (!point.settled) continue;
    common += point.scale_variance;
    own +=
        point.covariance.trace() / (point.p_world - frame.T_world_camera.translation).squaredNorm();
    ++count;
  }
  return count > 0 ? common / count + own / (count * count) : before.scale_variance;
}

int settledFeatures(const TrackedFrame& frame) {
  return static_cast<int>(std::count_if(frame.features.begin(), frame.features.end(),
                                        [](const Feature& f) { return f.point->settled; }));
}

std::vector<Vector3d> settledPoints(const Map& map) {
  std::vector<Vector3d> points;
  for (const auto& point : map.points)
    if (!point->bad && point->settled) points.push_back(point->p_world);
  return points;
}

bool isCertain(const MapPoint& point, const TrackedFrame& frame) {
  constexpr double kCertain = 0.03;
  const double distance = (point.p_world - frame.T_world_camera.translation).norm();
  return point.settled && std::sqrt(point.covariance.trace()) < kCertain * distance;
}

int certainFeatures(const TrackedFrame& frame) {
  return static_cast<int>(
      std::count_if(frame.features.begin(), frame.features.end(),
                    [&](const Feature& f) { return isCertain(*f.point, frame); }));
}

DepthRange depthRange(const TrackedFrame& frame) {
  std::vector<double> depths;
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  for (const Feature& feature : frame.features) {
    const double z = (T_camera_world * feature.point->p_world).z();
    if (z > 0) depths.push_back(z);
  }
  if (depths.size() < 5) return {};
  std::sort(depths.begin(), depths.end());
  return {depths[depths.size() / 2], depths[depths.size() / 20]};
}

}  // namespace diorama::vo
