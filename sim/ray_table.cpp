#include "sim/ray_table.h"

#include <cmath>

namespace diorama {

RayTable::RayTable(const Camera& camera)
    : tiles_x_((camera.width() + kTileSize - 1) / kTileSize),
      tiles_y_((camera.height() + kTileSize - 1) / kTileSize) {
  packets_.reserve(static_cast<size_t>(tileCount() * kPacketsPerTile));
  for (int tile = 0; tile < tileCount(); ++tile)
    for (int p = 0; p < kPacketsPerTile; ++p)
      packets_.push_back(makePacket(camera, packetX(tile, p), packetY(tile, p)));
}

PacketRays RayTable::makePacket(const Camera& camera, int x, int y) const {
  PacketRays rays{};
  const auto unproject = [&](double u, double v) { return camera.unproject(Vector2d(u, v)); };
  for (int lane = 0; lane < 8; ++lane) {
    const int u = x + laneX(lane), v = y + laneY(lane);
    if (u >= camera.width() || v >= camera.height()) continue;
    rays.inside |= 1 << lane;
    const auto direction = unproject(u, v);
    if (!direction) continue;
    rays.x[lane] = static_cast<float>(direction->x());
    rays.y[lane] = static_cast<float>(direction->y());
    rays.valid |= 1 << lane;
  }
  // The packet's middle lies between its pixels; the change across it stands for all eight.
  const double u = x + 1.5, v = y + 0.5;
  Eigen::Matrix2d J = Eigen::Vector2d(1 / camera.fx(), 1 / camera.fy()).asDiagonal();
  const auto left = unproject(u - 1, v), right = unproject(u + 1, v), up = unproject(u, v - 1),
             down = unproject(u, v + 1);
  if (left && right && up && down) J << (*right - *left).head<2>() / 2, (*down - *up).head<2>() / 2;
  rays.dx_du = static_cast<float>(J(0, 0));
  rays.dx_dv = static_cast<float>(J(0, 1));
  rays.dy_du = static_cast<float>(J(1, 0));
  rays.dy_dv = static_cast<float>(J(1, 1));
  rays.pixel = static_cast<float>(std::sqrt(std::abs(J(0, 0) * J(1, 1) - J(0, 1) * J(1, 0))));
  return rays;
}

Vector2d extendedDirection(const Camera& camera, const Vector2d& u_px) {
  if (const auto direction = camera.unproject(u_px)) return direction->head<2>();
  const CameraParameters& k = camera.parameters();
  const Vector2d center(k.cx, k.cy), offset = u_px - center;
  double inside = 0, outside = 1;  // fractions of the offset
  for (int step = 0; step < 20; ++step) {
    const double middle = (inside + outside) / 2;
    (camera.unproject(center + middle * offset) ? inside : outside) = middle;
  }
  Vector2d edge = Vector2d::Zero();
  if (const auto direction = camera.unproject(center + inside * offset))
    edge = direction->head<2>();
  const Vector2d rest = (1 - inside) * offset;
  return edge + Vector2d(rest.x() / k.fx, rest.y() / k.fy);
}

ExtendedGrid::ExtendedGrid(const Camera& camera)
    : width_(camera.width()),
      height_(camera.height()),
      columns_(3 * width_ / kCell + 1),
      rows_(3 * height_ / kCell + 1) {
  for (int r = 0; r <= rows_; ++r)
    for (int c = 0; c <= columns_; ++c)
      corners_.push_back(extendedDirection(camera, Vector2d(cellX(c), cellY(r))).cast<float>());
}

ExtendedGrid::Directions ExtendedGrid::row(int c, int r, int row) const {
  const float fv = static_cast<float>(row) / kCell;
  const Eigen::Vector2f a = (1 - fv) * corner(c, r) + fv * corner(c, r + 1);
  const Eigen::Vector2f b = (1 - fv) * corner(c + 1, r) + fv * corner(c + 1, r + 1);
  const simd::Float8 fu = simd::Float8{0, 1, 2, 3, 4, 5, 6, 7} / static_cast<float>(kCell);
  return {a.x() + fu * (b.x() - a.x()), a.y() + fu * (b.y() - a.y())};
}

}  // namespace diorama
