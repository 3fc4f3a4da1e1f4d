#include "sim/view_painter.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

#include "sim/shading.h"
#include "sim/single_triangle.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

// Rays through pixels of a view against the triangles (+ 1) of a scene that they show; 0: none.
PacketHits hitsOf(const RenderScene& scene, const RayPacket& rays, Int8 ids) {
  PacketHits hits;
  hits.t = hits.u = hits.v = splat(0.f);
  hits.normal = simd::splat3(0, 0, 1);
  hits.triangle = hits.mask = splat(0);
  unsigned pending = static_cast<unsigned>(simd::bits(ids > 0));
  while (pending) {
    const int id = ids[__builtin_ctz(pending)];
    const Int8 lanes = ids == id;
    pending &= ~static_cast<unsigned>(simd::bits(lanes));
    const PacketHits one = SingleTriangle(scene, static_cast<uint32_t>(id - 1)).plane(rays, lanes);
    hits.t = simd::select(one.mask, one.t, hits.t);
    hits.u = simd::select(one.mask, one.u, hits.u);
    hits.v = simd::select(one.mask, one.v, hits.v);
    hits.normal = simd::select(one.mask, one.normal, hits.normal);
    hits.triangle = simd::select(one.mask, one.triangle, hits.triangle);
    hits.mask |= one.mask;
  }
  return hits;
}

}  // namespace

void ViewPainter::addRows(const WideView& view, int row, const Subframe& subframe,
                          const std::vector<uint32_t>& ids,
                          std::vector<LinearColor>& colors) const {
  const PinholeView& pinhole = view.pinhole;
  const auto fx = static_cast<float>(pinhole.fx), fy = static_cast<float>(pinhole.fy);
  const auto left = static_cast<float>(subframe.shift_px.x() - pinhole.cx),
             top = static_cast<float>(subframe.shift_px.y() - pinhole.cy + row);
  const Float8 columns = {0, 1, 2, 3, 0, 1, 2, 3}, rows = {0, 0, 0, 0, 1, 1, 1, 1};
  const Float8 y = (rows + top) / fy, pixel = splat(1 / std::sqrt(fx * fy));
  std::vector<CameraFrame> frames;  // of the view in each layer
  for (const SE3& T_layer_camera : subframe.T_layer_camera)
    frames.emplace_back(
        T_layer_camera *
        SE3{Eigen::Quaterniond(Matrix3d(view.R_view_camera.transpose())), Vector3d::Zero()});
  const auto stride = static_cast<size_t>(pinhole.width);
  const size_t first = static_cast<size_t>(row) * stride;
  const uint8_t* needed = &view.needed[first / (kPacketWidth * kPacketHeight)];
  for (int column = 0; column < pinhole.width; column += kPacketWidth) {
    if (!*needed++) continue;
    const size_t at = first + static_cast<size_t>(column);
    Int8 shown;
    std::memcpy(&shown, &ids[at], sizeof shown / 2);
    std::memcpy(reinterpret_cast<char*>(&shown) + sizeof shown / 2, &ids[at + stride],
                sizeof shown / 2);
    const Float8 x = (columns + (left + static_cast<float>(column))) / fx;
    const Vector8 color =
        simd::min(colorOf(shown, frames, x, y, pixel), splat(brightest)) * splat(subframe.weight);
    for (int lane = 0; lane < 8; ++lane) {
      LinearColor& to =
          colors[at + static_cast<size_t>(laneX(lane)) + static_cast<size_t>(laneY(lane)) * stride];
      to.r += color.x[lane];
      to.g += color.y[lane];
      to.b += color.z[lane];
    }
  }
}

// What rays of directions (x, y, 1) see of the triangles with these ids.
Vector8 ViewPainter::colorOf(Int8 shown, const std::vector<CameraFrame>& frames, Float8 x, Float8 y,
                             Float8 pixel) const {
  Vector8 color = simd::splat3(layers.front()->sky);
  int first = 0;
  for (size_t k = 0; k < layers.size(); ++k) {
    const RenderScene& layer = *layers[k];
    const auto count = static_cast<int>(layer.triangles.size());
    const Int8 in_layer = (shown > first) & (shown <= first + count);
    if (simd::bits(in_layer)) {
      const RayPacket rays = frames[k].rays(x, y);
      const PacketHits hits = hitsOf(layer, rays, in_layer & (shown - first));
      const Surface surface = shading::surfaceOfPixel(layer, lights[k], rays, hits, pixel);
      color = simd::select(hits.mask, shading::radianceOf(layer, lights[k], rays, hits, surface),
                           color);
    }
    first += count;
  }
  return color;
}

}  // namespace diorama
