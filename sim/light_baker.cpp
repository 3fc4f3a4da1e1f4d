#include "sim/light_baker.h"

#include <algorithm>
#include <cmath>

#include "sim/light_grid.h"
#include "sim/light_sampler.h"
#include "sim/shading.h"

namespace diorama {
namespace {

using simd::Float8;
using simd::Int8;
using simd::splat;

class Baker {
 public:
  Baker(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool)
      : scene_(scene), options_(options), pool_(pool) {}

  void run() {
    layOutLight(scene_, {options_.spacing_m, options_.spacing_growth, options_.max_samples});
    direct_grid_ = makeLightGrid(scene_);
    bounce_grid_ = makeLightGrid(scene_, 3);  // bounced light has no sharp edges
    direct_.assign(direct_grid_.pointCount(), Vector3f::Zero());
    bounced_.assign(bounce_grid_.pointCount(), Vector3f::Zero());
    forPoints(direct_.size(), [&](size_t p) {
      const LitPoint point = lit(direct_grid_, p, static_cast<uint32_t>(p) * 977u);
      direct_[p] = directLight(scene_.lights, point, options_.shadow_rays, hidden_);
    });
    publish();
    for (int bounce = 0; bounce < options_.bounces; ++bounce) gather(bounce);
  }

 private:
  static constexpr size_t kChunk = 512;

  template <class Fn>
  void forPoints(size_t count, Fn fn) {
    const size_t chunks = (count + kChunk - 1) / kChunk;
    pool_.run(static_cast<int>(chunks), [&](int chunk) {
      const size_t first = static_cast<size_t>(chunk) * kChunk;
      for (size_t p = first; p < std::min(count, first + kChunk); ++p) fn(p);
    });
  }

  LitPoint lit(const LightGrid& grid, size_t p, uint32_t seed) const {
    return {grid.positions[p] + options_.surface_offset_m * grid.normals[p], grid.normals[p], seed};
  }

  void gather(int bounce) {
    const bool last = bounce == options_.bounces - 1;
    const int rays = (last ? options_.last_bounce_rays : options_.bounce_rays) / 8 * 8;
    std::vector<uint8_t> buried(bounced_.size(), 0);
    std::vector<Vector3f> next(bounced_.size());
    forPoints(next.size(), [&](size_t p) {
      int back_faces = 0;
      const LitPoint point =
          lit(bounce_grid_, p,
              static_cast<uint32_t>(p) * 31u + static_cast<uint32_t>(bounce) * 1013904223u);
      next[p] = gatheredLight(point, rays, seen_, back_faces);
      buried[p] = back_faces * 4 > rays;  // inside another solid
    });
    refill(bounce_grid_, buried, next);
    bounced_ = smoothed(bounce_grid_, last ? smoothed(bounce_grid_, next) : next);
    publish();
  }

  // Direct plus bounced light at every sample, packed.
  void publish() {
    std::vector<Vector3f> values(direct_grid_.point_of_sample.size()), bounced(values.size());
    forPoints(scene_.triangles.size(), [&](size_t k) {
      const int r = direct_grid_.resolution[k];
      auto s = static_cast<size_t>(direct_grid_.offset[k]);
      for (int j = 0; j <= r; ++j)
        for (int i = 0; i + j <= r; ++i, ++s) {
          bounced[s] = bounce_grid_.at(k, static_cast<float>(i) / static_cast<float>(r),
                                       static_cast<float>(j) / static_cast<float>(r), bounced_);
          values[s] = direct_[direct_grid_.point_of_sample[s]] + bounced[s];
        }
    });
    pack(values, bounced);
  }

  void pack(const std::vector<Vector3f>& values, const std::vector<Vector3f>& bounced) {
    double mean = 0, greatest = 0;
    for (const Vector3f& v : values) {
      mean += static_cast<double>(v.mean());
      greatest = std::max(greatest, static_cast<double>(v.maxCoeff()));
    }
    mean /= static_cast<double>(std::max<size_t>(1, values.size()));
    LightMap& map = scene_.light;
    map.typical = static_cast<float>(std::max(mean, 1e-12));
    // Spots beside a lamp are cut: 11 bits must serve the rest.
    map.max = static_cast<float>(std::clamp(greatest, 1e-12, 30 * std::max(mean, 1e-12)));
    map.samples.resize(values.size());
    map.bounced.resize(values.size());
    forPoints(values.size(), [&](size_t s) {
      map.samples[s] = packLight(values[s], map.max);
      map.bounced[s] = packLight(bounced[s], map.max);
    });
  }

  RenderScene& scene_;
  const LightBakerOptions& options_;
  WorkerPool& pool_;
  LightGrid direct_grid_, bounce_grid_;
  std::vector<Vector3f> direct_, bounced_;  // irradiance / pi per point
  const HiddenRays hidden_ = [this](const RayPacket& rays, Int8 active, Float8 end) {
    return scene_.bvh->occluded(rays, active, splat(0.f), end, true);
  };
  const SeenRadiance seen_ = [this](const RayPacket& rays, int& back_faces) {
    return shading::diffuseRadiance(scene_, scene_.lightView(), rays,
                                    scene_.bvh->closest(rays, splat(-1), splat(0.f), false),
                                    back_faces);
  };
};

}  // namespace

void bakeLight(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool) {
  Baker(scene, options, pool).run();
}

}  // namespace diorama
