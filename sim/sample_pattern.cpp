#include "sim/sample_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "core/errors.h"

namespace diorama {
namespace {

// Strata of a column, a row and a moment.
struct Strata {
  uint8_t u, v, moment;
};

// Half of 16, 32 and 64 samples; the other half lies opposite to them. Each stratum is used once.
// Found by annealing: of an edge that crosses the pixel in any direction while it moves by up to 4,
// 5 and 8 px, all samples tell the covered part within 0.036, 0.024 and 0.016 (rms), the first half
// of them within 0.058, 0.037 and 0.024. Lattices fail where edge and motion suit them ill.
constexpr std::array<Strata, 8> kOf16 = {
    {{5, 15, 6}, {6, 6, 13}, {0, 10, 12}, {3, 3, 4}, {7, 1, 0}, {2, 11, 1}, {1, 2, 10}, {4, 8, 7}}};
constexpr std::array<Strata, 16> kOf32 = {{{4, 29, 26},
                                           {2, 5, 20},
                                           {10, 6, 3},
                                           {13, 9, 29},
                                           {15, 4, 17},
                                           {8, 17, 25},
                                           {7, 24, 7},
                                           {3, 13, 12},
                                           {12, 16, 0},
                                           {1, 23, 15},
                                           {11, 12, 21},
                                           {0, 20, 4},
                                           {9, 28, 22},
                                           {14, 21, 13},
                                           {5, 1, 30},
                                           {6, 0, 8}}};
constexpr std::array<Strata, 32> kOf64 = {
    {{9, 28, 30},  {8, 56, 61},  {15, 4, 59},  {12, 29, 51}, {24, 57, 9},  {14, 27, 21},
     {26, 63, 39}, {6, 12, 38},  {21, 46, 19}, {5, 62, 26},  {27, 38, 58}, {30, 5, 31},
     {1, 9, 11},   {23, 30, 43}, {19, 48, 50}, {7, 32, 3},   {13, 37, 14}, {2, 16, 47},
     {0, 2, 0},    {11, 49, 46}, {16, 24, 35}, {25, 10, 15}, {22, 20, 7},  {18, 55, 1},
     {3, 52, 18},  {10, 21, 57}, {20, 3, 40},  {31, 23, 27}, {29, 50, 41}, {4, 41, 29},
     {17, 44, 55}, {28, 18, 53}}};

std::span<const Strata> strata(int count) {
  switch (count) {
    case 8:
      return kOf16;
    case 16:
      return kOf32;
    case 32:
      return kOf64;
  }
  DIORAMA_CHECK(!"a sample count of 8, 16 or 32");
}

PixelSample makeSample(double du, double dv, float dither, const SE3& T_world_camera) {
  const Eigen::Matrix3f R = T_world_camera.rotationMatrix().cast<float>();
  return {static_cast<float>(du),
          static_cast<float>(dv),
          T_world_camera.translation.cast<float>(),
          R.col(0),
          R.col(1),
          R.col(2),
          dither};
}

std::vector<SampleLanes> inLanes(const std::vector<PixelSample>& samples) {
  std::vector<SampleLanes> result(samples.size() / 8);
  for (size_t k = 0; k < samples.size(); ++k) {
    SampleLanes& to = result[k / 8];
    const PixelSample& from = samples[k];
    const size_t lane = k % 8;
    to.du[lane] = from.du;
    to.dv[lane] = from.dv;
    to.dither[lane] = from.dither;
    const auto put = [&](simd::Vector8& v, const Vector3f& p) {
      v.x[lane] = p.x();
      v.y[lane] = p.y();
      v.z[lane] = p.z();
    };
    put(to.origin, from.origin);
    put(to.axis_x, from.axis_x);
    put(to.axis_y, from.axis_y);
    put(to.axis_z, from.axis_z);
  }
  return result;
}

// Four samples of which each has a row, a column and a moment of its own: half of them.
constexpr std::array<Strata, 2> kOf4 = {{{1, 3, 1}, {3, 2, 0}}};

// Samples in pairs that lie opposite to each other, out of `strata` to a side.
void addPairs(std::span<const Strata> table, int strata, const ExposureMotion& motion,
              double row_offset_s, std::vector<PixelSample>& samples) {
  const auto pairs = static_cast<int>(table.size());
  const auto place = [&](uint8_t stratum) { return (stratum + 0.5) / strata - 0.5; };
  for (int k = 0; k < pairs; ++k) {
    const auto [u, v, moment] = table[static_cast<size_t>(k)];
    // The same for samples opposite to each other. Were one of them blurred more, edges would move.
    const float dither = (static_cast<float>(k * 3 % pairs) + 0.5f) / static_cast<float>(pairs);
    for (const int side : {1, -1}) {
      const double offset_s = side * motion.exposure_s * place(moment);
      samples.push_back(makeSample(side * place(u), side * place(v), dither,
                                   motion.T_world_camera(row_offset_s + offset_s)));
    }
  }
}

SamplePattern makeSamplePattern(const PatternOptions& options, const ExposureMotion& motion,
                                double row_offset_s) {
  const std::span<const Strata> table = strata(options.count);
  const size_t half = table.size() / 2;
  SamplePattern pattern;
  addPairs(table.first(half), 2 * options.count, motion, row_offset_s, pattern.base);
  addPairs(table.subspan(half), 2 * options.count, motion, row_offset_s, pattern.extra);
  pattern.taps = pattern.base;
  if (options.taps != options.count) {
    DIORAMA_CHECK(options.taps == 4);
    pattern.taps.clear();
    addPairs(kOf4, 4, motion, row_offset_s, pattern.taps);
  }
  pattern.base_lanes = inLanes(pattern.base);
  pattern.extra_lanes = inLanes(pattern.extra);
  pattern.footprint = options.footprint;
  pattern.tap_footprint = options.tap_footprint;
  return pattern;
}

}  // namespace

MovingPattern::MovingPattern(const PatternOptions& options, const ExposureMotion& motion,
                             int height, WorkerPool& pool)
    : by_row_(motion.row_time_s == 0 ? 1 : static_cast<size_t>(height)) {
  pool.run(static_cast<int>(by_row_.size()), [&](int y) {
    const double offset_s = by_row_.size() == 1 ? 0 : motion.rowOffset_s(y, height);
    by_row_[static_cast<size_t>(y)] = makeSamplePattern(options, motion, offset_s);
  });
}

double MovingPattern::farthest(const Vector3d& from) const {
  double distance2 = 0;
  for (const SamplePattern& pattern : by_row_)
    for (const std::vector<PixelSample>* samples : {&pattern.taps, &pattern.base, &pattern.extra})
      for (const PixelSample& s : *samples)
        distance2 = std::max(distance2, (s.origin.cast<double>() - from).squaredNorm());
  return std::sqrt(distance2);
}

}  // namespace diorama
