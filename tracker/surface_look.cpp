#include "tracker/surface_look.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core/hal/intrin.hpp>

#include "tracker/surface_points.h"

namespace diorama {
namespace {

constexpr double kSteepest = 0.25;    // cosine between normal and ray: steeper ones are not seen
constexpr float kRate = 0.2f;         // of the running mean of what a point looks like
constexpr float kSpreadRate = 0.05f;  // ... and of its differences: slower than covers come
constexpr float kFirstSpread = 10;    // levels: one frame tells little
constexpr int kReach = 2;             // px around a point that are averaged
constexpr float kPixels = (2 * kReach + 1) * (2 * kReach + 1);
constexpr float kDark = 16;              // levels; darker ones have no ratio worth the name
constexpr float kLargestChange = 1.25f;  // of the light from one learned frame to the next
constexpr size_t kFewest = 20;
constexpr double kSmallestCell = 8;  // px: a pose is off by less than half of it

std::pair<int, int> pixelOf(const Vector2d& u_px) {  // which lies in the image
  return {static_cast<int>(u_px.x() + 0.5), static_cast<int>(u_px.y() + 0.5)};
}

// Mean of the pixels within kReach; grey values have three equal channels.
Vector3f meanAround(const Image<uint8_t>& image, int x, int y) {
  int sum = 0;
  for (int j = -kReach; j <= kReach; ++j) {
    const uint8_t* row = image.row(y + j) + x;
    for (int i = -kReach; i <= kReach; ++i) sum += row[i];
  }
  return Vector3f::Constant(static_cast<float>(sum) / kPixels);
}

Vector3f meanAround(const Image<Rgb8>& image, int x, int y) {
  // Column by column first, as vectors; one byte more makes a round number of them.
  constexpr int kBytes = 3 * (2 * kReach + 1);
  static_assert(kBytes == 15);
  cv::v_uint16x8 low = cv::v_setzero_u16(), high = low;
  for (int j = -kReach; j <= kReach; ++j) {
    const uint8_t* row = &image(x - kReach, y + j).r;
    low += cv::v_load_expand(row);
    high += cv::v_load_expand(row + 8);
  }
  uint16_t columns[kBytes + 1];
  cv::v_store(columns, low);
  cv::v_store(columns + 8, high);
  Eigen::Vector3i sum = Eigen::Vector3i::Zero();
  for (int i = 0; i < kBytes; ++i) sum[i % 3] += columns[i];
  return sum.cast<float>() / kPixels;
}

// Points lie scattered over the image: their pixels are fetched while the rays are cast.
template <class Pixel>
void fetchAround(const Image<Pixel>& image, int x, int y) {
  for (int j = -kReach; j <= kReach; ++j) __builtin_prefetch(&image(x, y + j));
}

}  // namespace

CoverMap::CoverMap(const Vector2d& low_px, const Vector2d& high_px) : low_px_(low_px) {
  const Vector2d size = high_px - low_px;
  if (!(size.minCoeff() > 0)) return;
  cell_px_ = std::max(kSmallestCell, size.maxCoeff() / kCells);
  width_ = static_cast<int>(size.x() / cell_px_) + 1;
  height_ = static_cast<int>(size.y() / cell_px_) + 1;
  cells_.resize(static_cast<size_t>(width_ * height_));
}

void CoverMap::add(const Vector2d& u_px, bool like_before) {
  if (cells_.empty()) return;
  const Vector2d at = (u_px - low_px_) / cell_px_;
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
  Cell& cell = cells_[static_cast<size_t>(y * width_ + x)];
  ++cell.known;
  cell.changed += !like_before;
}

bool CoverMap::isCovered(const Vector2d& u_px) const {
  if (cells_.empty()) return false;
  // The four cells whose common corner is nearest.
  const Vector2d at = (u_px - low_px_) / cell_px_;
  const int x = static_cast<int>(std::floor(at.x() + 0.5));
  const int y = static_cast<int>(std::floor(at.y() + 0.5));
  Cell sum;
  for (int j = std::max(0, y - 1); j <= std::min(height_ - 1, y); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(width_ - 1, x); ++i) {
      const Cell& cell = cells_[static_cast<size_t>(j * width_ + i)];
      sum.known += cell.known;
      sum.changed += cell.changed;
    }
  return sum.isCovered();
}

bool CoverMap::any() const {
  return std::any_of(cells_.begin(), cells_.end(), [](const Cell& c) { return c.isCovered(); });
}

bool CoverMap::touches(const Vector2d& u, double reach) const {
  for (const double x : {-reach, 0.0, reach})
    for (const double y : {-reach, 0.0, reach})
      if (isCovered(u + Vector2d(x, y))) return true;
  return false;
}

SurfaceLook::SurfaceLook(const Mesh& mesh, const Vector3d& centre_object, const Camera& camera,
                         const RayQuery& rays, int object, const TrackerOptions& options)
    : centre_object_(centre_object),
      camera_(camera),
      rays_(rays),
      object_(object),
      options_(options),
      tolerance_(static_cast<float>(options.surface_tolerance)) {
  if (options_.surface_points == 0) return;
  for (const SurfacePoint& s : scatterPoints(mesh, options_.surface_points))
    points_.push_back({s.p - centre_object_, s.normal});
}

std::vector<SurfaceLook::Sight> SurfaceLook::look(const EdgePicture& picture, const SE3& T) const {
  const Vector3d eye = T.inverse().translation;
  const Matrix3d R = T.rotationMatrix();
  std::vector<Sight> sights;
  std::vector<Vector3d> places;
  for (size_t i = 0; i < points_.size(); ++i) {
    const Vector3d ray = eye - points_[i].p;
    if (points_[i].normal.dot(ray) < kSteepest * ray.norm()) continue;
    const auto u = camera_.project(R * points_[i].p + T.translation);
    if (!u || !camera_.contains(*u, kReach + 1)) continue;
    sights.push_back({i, *u, Vector3f::Zero()});
    const auto [x, y] = pixelOf(*u);
    picture.rgb ? fetchAround(*picture.rgb, x, y) : fetchAround(*picture.grey, x, y);
    places.push_back(points_[i].p + centre_object_);
  }
  std::vector<uint8_t> hidden(places.size());
  rays_.occluded(object_, eye + centre_object_, places, hidden);
  size_t kept = 0;
  for (size_t i = 0; i < sights.size(); ++i) {
    if (hidden[i]) continue;
    Sight& sight = sights[kept++] = sights[i];
    const auto [x, y] = pixelOf(sight.u_px);
    sight.value = picture.rgb ? meanAround(*picture.rgb, x, y) : meanAround(*picture.grey, x, y);
  }
  sights.resize(kept);
  return sights;
}

// The light has changed by the median ratio of what is seen to what is known, but not by leaps:
// these are of things that cover the object.
float SurfaceLook::brightness(const std::vector<Sight>& sights) const {
  std::vector<float> ratios;
  for (const Sight& sight : sights) {
    const Point& point = points_[sight.point];
    if (!point.known || point.value.sum() < 3 * kDark) continue;
    const float ratio = sight.value.sum() / point.value.sum();
    if (ratio < brightness_ * kLargestChange && ratio > brightness_ / kLargestChange)
      ratios.push_back(ratio);
  }
  if (ratios.size() < kFewest) return brightness_;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

float SurfaceLook::differenceOf(const Vector3f& value, const Point& point) {
  return (value - point.value).cwiseAbs().maxCoeff();
}

float SurfaceLook::toleranceOf(const Point& point) const { return tolerance_ + 3 * point.spread; }

CoverMap SurfaceLook::compare(const std::vector<Sight>& sights) const {
  if (!learned_ || sights.empty()) return {};
  Vector2d low = sights.front().u_px, high = low;
  for (const Sight& sight : sights) {
    low = low.cwiseMin(sight.u_px);
    high = high.cwiseMax(sight.u_px);
  }
  CoverMap cover(low, high);
  const float gain = brightness(sights);
  for (const Sight& sight : sights) {
    const Point& point = points_[sight.point];
    if (!point.known) continue;
    cover.add(sight.u_px, differenceOf(sight.value / gain, point) <= toleranceOf(point));
  }
  return cover;
}

void SurfaceLook::learn(const std::vector<Sight>& sights, const CoverMap& cover) {
  brightness_ = brightness(sights);
  learned_ = true;
  for (const Sight& sight : sights) {
    Point& point = points_[sight.point];
    const Vector3f value = sight.value / brightness_;
    const bool covered = cover.isCovered(sight.u_px);
    if (!point.known) {
      point.known = !covered;
      point.value = value;
      point.spread = kFirstSpread;
      continue;
    }
    const float difference = differenceOf(value, point);
    if (!covered) point.spread += kSpreadRate * (std::min(difference, tolerance_) - point.spread);
    if (difference <= toleranceOf(point)) {
      point.value += kRate * (value - point.value);
      point.changed_for = 0;
    } else if (++point.changed_for > options_.surface_patience) {
      point = {point.p, point.normal};  // what was learned may have been a cover
    }
  }
}

}  // namespace diorama
