#include "sim/wide_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace diorama {
namespace {

// Up to this tangent of the angle off the axis (56 degrees) one view is good: farther out it would
// spend most of its pixels on the border.
constexpr double kWidestTangent = 1.5;

int roundUp(double x, int multiple) { return multiple * static_cast<int>(std::ceil(x / multiple)); }

// What a table says of a pixel: its ray and how the ray changes from pixel to pixel.
struct PixelRay {
  int x, y;
  Vector3d direction, du, dv;  // camera frame, z = 1
};

template <class Fn>
void forEachRay(const RayTable& table, Fn fn) {
  for (int tile = 0; tile < table.tileCount(); ++tile)
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketRays& packet = table.packet(tile, p);
      const auto wide = [](float a, float b) { return Vector3d(a, b, 0); };
      for (int lane = 0; lane < 8; ++lane)
        if (packet.valid >> lane & 1)
          fn(PixelRay{table.packetX(tile, p) + laneX(lane), table.packetY(tile, p) + laneY(lane),
                      wide(packet.x[lane], packet.y[lane]) + Vector3d::UnitZ(),
                      wide(packet.dx_du, packet.dy_du), wide(packet.dx_dv, packet.dy_dv)});
    }
}

// Rows are the axes of the cube's sides: forward, right, left, down, up.
std::vector<Matrix3d> cubeSides() {
  std::vector<Matrix3d> sides(5);
  sides[0].setIdentity();
  sides[1] << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  sides[2] << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  sides[3] << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  sides[4] << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return sides;
}

size_t sideOf(const Vector3d& d) {
  const double ax = std::abs(d.x()), ay = std::abs(d.y());
  if (std::max(ax, ay) <= 1) return 0;
  return ax >= ay ? (d.x() > 0 ? 1 : 2) : (d.y() > 0 ? 3 : 4);
}

// A pixel's centre and extent in a view with these focal lengths, px from the view's axis.
struct Footprint {
  Vector2d center, extent;
  Footprint(const PixelRay& ray, const Matrix3d& R_view_camera, const Vector2d& focal_px)
      : center(toPixel(R_view_camera * ray.direction, focal_px)) {
    const auto change = [&](const Vector3d& step) -> Vector2d {
      return toPixel(R_view_camera * (ray.direction + step / 2), focal_px) -
             toPixel(R_view_camera * (ray.direction - step / 2), focal_px);
    };
    const Vector2d du = change(ray.du), dv = change(ray.dv);
    // At the rim of a fisheye's field the change from pixel to pixel may not be known.
    static constexpr double kMost_px = 16;
    const auto bounded = [](double x) { return std::min(std::max(1.0, x), kMost_px); };
    extent = Vector2d(bounded(std::hypot(du.x(), dv.x())), bounded(std::hypot(du.y(), dv.y())));
  }
  static Vector2d toPixel(const Vector3d& d, const Vector2d& focal_px) {
    return d.head<2>().cwiseProduct(focal_px) / d.z();
  }
};

// The part of a view's plane that is used, px from the axis.
struct Bounds {
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  void extend(const Footprint& f) {
    low = low.cwiseMin(f.center - f.extent / 2);
    high = high.cwiseMax(f.center + f.extent / 2);
  }
  bool empty() const { return !(low.x() < high.x()); }
};

WideView makeView(const Matrix3d& R_view_camera, const Bounds& bounds, const Vector2d& focal_px) {
  WideView view;
  view.R_view_camera = R_view_camera;
  const Vector2d size = bounds.high - bounds.low;
  // A pinhole camera's pixels are tiled exactly: the first one begins where a pixel of the view
  // does.
  constexpr int kMargin = WideViews::kMargin;
  view.pinhole = {roundUp(size.x() + 2 * kMargin, kPacketWidth),
                  roundUp(size.y() + 2 * kMargin, kPacketHeight),
                  focal_px.x(),
                  focal_px.y(),
                  kMargin - 0.5 - bounds.low.x(),
                  kMargin - 0.5 - bounds.low.y()};
  view.needed.resize(static_cast<size_t>(view.pinhole.width / kPacketWidth *
                                         (view.pinhole.height / kPacketHeight)));
  return view;
}

// Overlap of the pixel [i - 0.5, i + 0.5] with [from, to].
float overlap(int i, float from, float to) {
  const auto at = static_cast<float>(i);
  return std::max(0.f, std::min(at + 0.5f, to) - std::max(at - 0.5f, from));
}

// The pixels that an extent around a centre meets.
struct Span {
  float from, to;
  int first, last;
  Span(float center, float extent)
      : from(center - extent / 2),
        to(center + extent / 2),
        first(static_cast<int>(std::floor(from + 0.5f))),
        last(static_cast<int>(std::floor(to + 0.5f))) {}
};

void markNeeded(const PlacedPixel& pixel, WideView& view) {
  const Span columns(pixel.x, pixel.width), rows(pixel.y, pixel.height);
  const int stride = view.pinhole.width / kPacketWidth;
  for (int r = rows.first / kPacketHeight; r <= rows.last / kPacketHeight; ++r)
    for (int c = columns.first / kPacketWidth; c <= columns.last / kPacketWidth; ++c)
      view.needed[static_cast<size_t>(r * stride + c)] = 1;
}

}  // namespace

WideViews::WideViews(const Camera& camera, const RayTable& table, int scale)
    : placed_(camera.width(), camera.height()) {
  double widest = 0;
  forEachRay(table, [&](const PixelRay& ray) {
    widest = std::max(widest, ray.direction.head<2>().cwiseAbs().maxCoeff());
  });
  const std::vector<Matrix3d> sides = cubeSides();
  const Vector2d focal_px = scale * Vector2d(camera.fx(), camera.fy());
  const auto sideFor = [&](const PixelRay& ray) {
    return widest <= kWidestTangent ? 0 : sideOf(ray.direction);
  };
  std::vector<Bounds> bounds(sides.size());
  forEachRay(table, [&](const PixelRay& ray) {
    const size_t side = sideFor(ray);
    bounds[side].extend(Footprint(ray, sides[side], focal_px));
  });
  std::vector<int> view_of_side(sides.size(), -1);
  for (size_t side = 0; side < sides.size(); ++side) {
    if (bounds[side].empty()) continue;
    view_of_side[side] = static_cast<int>(views_.size());
    views_.push_back(makeView(sides[side], bounds[side], focal_px));
  }
  forEachRay(table, [&](const PixelRay& ray) {
    const size_t side = sideFor(ray);
    const Footprint f(ray, sides[side], focal_px);
    WideView& view = views_[static_cast<size_t>(view_of_side[side])];
    PlacedPixel& pixel = placed_(ray.x, ray.y);
    pixel = {static_cast<float>(f.center.x() + view.pinhole.cx),
             static_cast<float>(f.center.y() + view.pinhole.cy), static_cast<float>(f.extent.x()),
             static_cast<float>(f.extent.y()), view_of_side[side]};
    markNeeded(pixel, view);
  });
}

Radiance WideViews::mean(int x, int y, const std::vector<std::vector<LinearColor>>& colors) const {
  const PlacedPixel& pixel = placed_(x, y);
  if (pixel.view < 0) return {};
  const auto view = static_cast<size_t>(pixel.view);
  const Span columns(pixel.x, pixel.width), rows(pixel.y, pixel.height);
  const LinearColor* row =
      colors[view].data() +
      static_cast<size_t>(rows.first) * static_cast<size_t>(views_[view].pinhole.width);
  LinearColor sum;
  for (int j = rows.first; j <= rows.last; ++j, row += views_[view].pinhole.width) {
    const float weight = overlap(j, rows.from, rows.to);
    for (int i = columns.first; i <= columns.last; ++i) {
      const float w = weight * overlap(i, columns.from, columns.to);
      sum.r += w * row[i].r;
      sum.g += w * row[i].g;
      sum.b += w * row[i].b;
      sum.unused += w;
    }
  }
  return {sum.r / sum.unused, sum.g / sum.unused, sum.b / sum.unused};
}

}  // namespace diorama
