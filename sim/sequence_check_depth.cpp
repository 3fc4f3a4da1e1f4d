#include "sim/sequence_check_depth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace diorama {
namespace {

// Depth files resolve 0.2 mm.
constexpr double kPlane_m = 0.0003;     // how far the pixels of a plane may lie off it
constexpr double kOff_m = 0.0015;       // samples further apart disagree
constexpr double kNeighbour_m = 0.004;  // a pixel nearer to the line of its neighbours continues it
constexpr double kConverged_m = 1e-4;
constexpr double kFlattest = 0.05;  // sine of the angle between a ray and a plane, about
constexpr int kGrid_px = 6;         // between samples
constexpr int kInstanceGrid_px = 2;
constexpr int kInstanceSamples = 300;

constexpr std::array<Pixel, 8> kAround = {
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}}};

Pixel operator+(Pixel a, Pixel b) { return {a.x + b.x, a.y + b.y}; }

bool inside(const Image<float>& image, Pixel p) {
  return p.x >= 0 && p.y >= 0 && p.x < image.width && p.y < image.height;
}

Pixel nearestPixel(const Vector2d& u_px) {
  return {static_cast<int>(std::lround(u_px.x())), static_cast<int>(std::lround(u_px.y()))};
}

}  // namespace

DepthComparison::DepthComparison(const Camera& camera) : camera_(camera) {
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      rays_.push_back(camera.unproject(Vector2d(x, y)).value_or(Vector3d::Zero()));
}

const Vector3d& DepthComparison::ray(int x, int y) const {
  return rays_[static_cast<size_t>(y) * static_cast<size_t>(camera_.width()) +
               static_cast<size_t>(x)];
}

// The plane through the 3 x 3 pixels around `center`, by least squares in inverse depth.
std::optional<DepthComparison::Plane> DepthComparison::planeOf(const DepthView& view, Pixel center,
                                                               uint16_t id) const {
  const auto [cx, cy] = center;
  if (cx < 1 || cy < 1 || cx + 2 > camera_.width() || cy + 2 > camera_.height())
    return std::nullopt;
  std::array<double, 9> w{};
  double mean = 0, along_u = 0, along_v = 0;
  size_t i = 0;
  for (int y = cy - 1; y <= cy + 1; ++y)
    for (int x = cx - 1; x <= cx + 1; ++x) {
      const float depth = view.depth_m(x, y);
      if (!(depth > 0) || view.ids(x, y) != id) return std::nullopt;
      w[i] = 1.0 / static_cast<double>(depth);
      mean += w[i] / 9;
      along_u += w[i] * (x - cx) / 6;
      along_v += w[i] * (y - cy) / 6;
      ++i;
    }
  const double limit = kPlane_m * mean * mean;  // dz = -z^2 dw
  for (int k = 0; k < 9; ++k)
    if (std::abs(w[static_cast<size_t>(k)] -
                 (mean + along_u * (k % 3 - 1) + along_v * (k / 3 - 1))) > limit)
      return std::nullopt;
  // From pixels to the coordinates of the rays, whose slope is that of the lens.
  const Vector3d &left = ray(cx - 1, cy), &right = ray(cx + 1, cy), &up = ray(cx, cy - 1),
                 &down = ray(cx, cy + 1), &middle = ray(cx, cy);
  if (left.z() == 0 || right.z() == 0 || up.z() == 0 || down.z() == 0 || middle.z() == 0)
    return std::nullopt;
  Matrix2d slope;
  slope.col(0) = (right - left).head<2>() / 2;
  slope.col(1) = (down - up).head<2>() / 2;
  const Vector2d gradient = slope.transpose().inverse() * Vector2d(along_u, along_v);
  return Plane{{gradient.x(), gradient.y(), mean - gradient.dot(middle.head<2>())}, center};
}

// A plane whose 3 x 3 pixels hold the one nearest to u: around it, or with it at their border.
std::optional<DepthComparison::Plane> DepthComparison::planeNear(const DepthView& view,
                                                                 const Vector2d& u_px,
                                                                 uint16_t id) const {
  const Pixel nearest = nearestPixel(u_px);
  if (!inside(view.depth_m, nearest) || view.ids(nearest.x, nearest.y) != id) return std::nullopt;
  if (const auto plane = planeOf(view, nearest, id)) return plane;
  for (const Pixel& step : kAround)
    if (const auto plane = planeOf(view, nearest + step, id)) return plane;
  return std::nullopt;
}

// Where `other` sees the point at this depth; with a rolling shutter the row that sees it decides
// its own pose.
std::optional<Vector2d> DepthComparison::project(const DepthView& view, Pixel pixel, double depth_m,
                                                 const DepthView& other, SE3& T_other_view,
                                                 const SE3& motion) const {
  const Vector3d p = depth_m * ray(pixel.x, pixel.y);
  constexpr int kRollingSteps = 4;
  const int steps = other.row_poses.empty() ? 1 : kRollingSteps;
  int row = pixel.y;
  std::optional<Vector2d> u;
  for (int step = 0; step < steps; ++step) {
    T_other_view = other.cameraOf(row).inverse() * motion * view.cameraOf(pixel.y);
    u = camera_.project(T_other_view * p);
    if (!u || !camera_.contains(*u)) return std::nullopt;
    row = static_cast<int>(std::lround(u->y()));
    if (row < 0 || row >= camera_.height()) return std::nullopt;
  }
  return u;
}

std::optional<double> DepthComparison::difference(const DepthView& view, Pixel pixel,
                                                  const DepthView& other) const {
  const double seen = static_cast<double>(view.depth_m(pixel.x, pixel.y));
  const Vector3d& direction = ray(pixel.x, pixel.y);
  if (!(seen > 0) || direction.z() == 0) return std::nullopt;
  const uint16_t id = view.ids(pixel.x, pixel.y);
  constexpr int kSteps = 5;
  double depth = seen;
  for (int step = 0; step < kSteps; ++step) {
    SE3 T_other_view;
    const auto u = project(view, pixel, depth, other, T_other_view);
    if (!u) return std::nullopt;
    const auto plane = planeNear(other, *u, id);
    if (!plane) return std::nullopt;
    // n . (depth R d + t) = 1
    const double along = plane->n.dot(T_other_view.rotation * direction);
    if (std::abs(along) * depth < kFlattest) return std::nullopt;
    const double crossing = (1 - plane->n.dot(T_other_view.translation)) / along;
    if (!(crossing > 0)) return std::nullopt;
    if (std::abs(crossing - depth) < kConverged_m) return seen - crossing;
    depth = crossing;
  }
  return std::nullopt;
}

std::optional<DepthComparison::Place> DepthComparison::placeOf(const DepthView& view, Pixel pixel,
                                                               const DepthView& other) const {
  const double seen = static_cast<double>(view.depth_m(pixel.x, pixel.y));
  SE3 T_other_view;
  const auto u = project(view, pixel, seen, other, T_other_view);
  if (!u) return std::nullopt;
  return Place{*u, T_other_view * (seen * ray(pixel.x, pixel.y))};
}

std::optional<Vector2d> DepthComparison::carry(const DepthView& view, Pixel pixel, double depth_m,
                                               const DepthView& other, const SE3& motion) const {
  SE3 T_other_view;
  return project(view, pixel, depth_m, other, T_other_view, motion);
}

double DepthComparison::footprint(const DepthView& view, Pixel pixel) const {
  return static_cast<double>(view.depth_m(pixel.x, pixel.y)) / std::min(camera_.fx(), camera_.fy());
}

std::optional<Vector3d> DepthComparison::normal(const DepthView& view, Pixel pixel) const {
  const auto plane = planeOf(view, pixel, view.ids(pixel.x, pixel.y));
  if (!plane) return std::nullopt;
  constexpr double kResolved_m = 0.0008;  // four steps of the depth's units
  if (footprint(view, pixel) < kResolved_m) return std::nullopt;
  return -plane->n.normalized();
}

bool DepthComparison::mayShow(const DepthView& view, Pixel pixel, const DepthView& other) const {
  const auto place = placeOf(view, pixel, other);
  if (!place) return false;
  const Pixel nearest = nearestPixel(place->u_px);
  const uint16_t id = view.ids(pixel.x, pixel.y);
  const double z = place->p.z();
  if (const auto plane = planeOf(other, nearest, id))
    return std::abs(z - z / plane->n.dot(place->p)) < kNeighbour_m;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (int y = nearest.y - 1; y <= nearest.y + 1; ++y)
    for (int x = nearest.x - 1; x <= nearest.x + 1; ++x) {
      if (!inside(other.depth_m, {x, y}) || other.ids(x, y) != id) continue;
      const double depth = static_cast<double>(other.depth_m(x, y));
      if (!(depth > 0)) continue;
      least = std::min(least, depth);
      most = std::max(most, depth);
    }
  return z > least - kNeighbour_m && z < most + kNeighbour_m;
}

namespace {

double inverseDepth(const Image<float>& z, Pixel p) {
  return inside(z, p) && z(p.x, p.y) > 0 ? 1.0 / static_cast<double>(z(p.x, p.y)) : 0.0;
}

// Lines of two pixels beside p, or of one on either side, that lead to the inverse depth w at p;
// no more than `enough` are counted.
int linesTo(const Image<float>& z, Pixel p, double w, int enough) {
  const double limit = kNeighbour_m * w * w;
  int lines = 0;
  for (size_t k = 0; k < kAround.size() && lines < enough; ++k) {
    const Pixel d = kAround[k];
    const double near = inverseDepth(z, p + d), far = inverseDepth(z, p + d + d);
    lines += near > 0 && far > 0 && std::abs(2 * near - far - w) < limit;
    if (d.x < 0 || (d.x == 0 && d.y < 0)) continue;  // the opposite pair is the same
    const double opposite = inverseDepth(z, p + Pixel{-d.x, -d.y});
    lines += near > 0 && opposite > 0 && std::abs((near + opposite) / 2 - w) < limit;
  }
  return lines;
}

}  // namespace

std::vector<Pixel> DepthComparison::lonelyPixels(const DepthView& view) const {
  std::vector<Pixel> lonely;
  for (int y = 0; y < view.depth_m.height; ++y)
    for (int x = 0; x < view.depth_m.width; ++x) {
      const double w = inverseDepth(view.depth_m, {x, y});
      if (w > 0 && linesTo(view.depth_m, {x, y}, w, 1) == 0) lonely.push_back({x, y});
    }
  return lonely;
}

int DepthComparison::continuedLines(const DepthView& view, Pixel pixel, double off_m) const {
  constexpr int kAll = 12;
  const double depth = static_cast<double>(view.depth_m(pixel.x, pixel.y)) - off_m;
  return depth > 0 ? linesTo(view.depth_m, pixel, 1 / depth, kAll) : 0;
}

bool DepthComparison::standsOff(const DepthView& view, Pixel pixel, double off_m) const {
  constexpr double kAbout = 0.5;  // of the distance
  const double depth = static_cast<double>(view.depth_m(pixel.x, pixel.y));
  return std::any_of(kAround.begin(), kAround.end(), [&](const Pixel& step) {
    const double w = inverseDepth(view.depth_m, pixel + step);
    return w > 0 && std::abs(depth - 1 / w - off_m) < kOff_m + kAbout * std::abs(off_m);
  });
}

std::vector<Agreement> DepthComparison::compare(const DepthView& view, const DepthView& other,
                                                int ids) const {
  std::vector<Agreement> result(static_cast<size_t>(ids));
  for (int y = kGrid_px / 2; y < camera_.height(); y += kGrid_px)
    for (int x = kGrid_px / 2; x < camera_.width(); x += kGrid_px) {
      const uint16_t id = view.ids(x, y);
      if (id >= ids || !planeOf(view, {x, y}, id)) continue;
      const auto apart = difference(view, {x, y}, other);
      if (!apart) continue;
      ++result[id].samples;
      result[id].off += std::abs(*apart) > kOff_m;
    }
  return result;
}

Agreement DepthComparison::compareInstance(const DepthView& view, const DepthView& other,
                                           uint16_t id) const {
  Agreement result;
  for (int y = 1; y < camera_.height(); y += kInstanceGrid_px)
    for (int x = 1; x < camera_.width(); x += kInstanceGrid_px) {
      if (view.ids(x, y) != id || !planeOf(view, {x, y}, id)) continue;
      const auto apart = difference(view, {x, y}, other);
      if (!apart) continue;
      result.off += std::abs(*apart) > kOff_m;
      if (++result.samples >= kInstanceSamples) return result;
    }
  return result;
}

}  // namespace diorama
