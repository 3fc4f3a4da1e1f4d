#include "vo/sparse_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace diorama::vo {
namespace {

constexpr int kSize = 4, kArea = kSize * kSize, kBordered = kSize + 2;
constexpr int kFewest = 10;           // patches: less does not hold six degrees of freedom
constexpr double kHuber = 1.345;      // 95% efficiency under normal errors
constexpr double kSmallestScale = 3;  // grey levels, of the robust weights
constexpr double kSettledM = 2e-5, kSettledRad = 2e-5;
// Brightness is not free: what gain and offset may take, as prior weights on their change.
constexpr double kGainPrior = 1, kOffsetPrior = 1e-3;

using Pixels = Eigen::Array<float, kArea, 1>;  // of a patch
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

struct ReferencePatch {
  Vector3d p_reference = Vector3d::Zero();
  Matrix26d J = Matrix26d::Zero();  // d u_level / d xi of the point's motion, p <- Exp(xi) p
  std::array<float, kArea> value{}, gx{}, gy{};
  bool seen = false;
};

struct Brightness {
  double gain = 1, offset = 0;
};

struct NormalEquations {
  Matrix8d H = Matrix8d::Zero();
  Vector8d g = Vector8d::Zero();
  double squares = 0;
  int patches = 0;
};

class Aligner {
 public:
  Aligner(const Camera& camera, const TrackedFrame& reference, const ImagePyramid& current,
          const VoOptions& options)
      : camera_(camera), reference_(reference), current_(current), options_(options) {
    const SE3 T_reference_world = reference.T_world_camera.inverse();
    // A keyframe has many corners of uncertain depth.
    const bool settled_only = settledFeatures(reference) >= options.unsettled_below;
    for (const Feature& feature : reference.features) {
      if (feature.point->bad || (settled_only && !feature.point->settled)) continue;
      ReferencePatch patch;
      patch.p_reference = T_reference_world * feature.point->p_world;
      patches_.push_back(patch);
    }
  }

  // False when too few patches are seen.
  bool alignLevel(int level, SparseAlignment& state);

 private:
  void cutPatches(int level);
  double medianDifference(int level, const SE3& T) const;
  NormalEquations linearise(int level, const SE3& T, double scale) const;
  void addPatch(const ReferencePatch& patch, const float* seen, double scale,
                NormalEquations& sum) const;
  Vector8d solve(NormalEquations equations) const;

  const Camera& camera_;
  const TrackedFrame& reference_;
  const ImagePyramid& current_;
  const VoOptions& options_;
  std::vector<ReferencePatch> patches_;
  Brightness brightness_;
};

constexpr float kMiddle =
    128;  // values are taken about it, so that gain and offset are independent

void Aligner::cutPatches(int level) {
  const Image<uint8_t>& image = reference_.pyramid->level(level);
  for (ReferencePatch& patch : patches_) {
    patch.seen = false;
    const auto projected = camera_.projectWithJacobian(patch.p_reference);
    std::array<float, kBordered * kBordered> block;
    if (!projected || !sampleBlock<kBordered>(image, toLevel(projected->u_px, level), block.data()))
      continue;
    patch.seen = true;
    patch.J.leftCols<3>() = levelScale(level) * projected->J;
    patch.J.rightCols<3>() = -patch.J.leftCols<3>() * skew(patch.p_reference);
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const size_t k = static_cast<size_t>(y * kSize + x);
        const float* p = &block[static_cast<size_t>((y + 1) * kBordered + x + 1)];
        patch.value[k] = *p - kMiddle;
        patch.gx[k] = 0.5f * (p[1] - p[-1]);
        patch.gy[k] = 0.5f * (p[kBordered] - p[-kBordered]);
      }
  }
}

// The scale of the robust weights: from the median of the patches' mean differences.
double Aligner::medianDifference(int level, const SE3& T) const {
  std::vector<float> means;
  std::array<float, kArea> seen;
  for (const ReferencePatch& patch : patches_) {
    const auto u = patch.seen ? camera_.project(T * patch.p_reference) : std::nullopt;
    if (!u || !sampleBlock<kSize>(current_.level(level), toLevel(*u, level), seen.data())) continue;
    const Pixels expected = static_cast<float>(brightness_.gain) * Pixels::Map(patch.value.data()) +
                            (kMiddle + static_cast<float>(brightness_.offset));
    means.push_back((Pixels::Map(seen.data()) - expected).abs().sum() / kArea);
  }
  if (means.empty()) return 0;
  const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
  std::nth_element(means.begin(), middle, means.end());
  return static_cast<double>(*middle);
}

// Sums over the pixels of one patch, lifted to the motion by its 2 x 6 Jacobian.
void Aligner::addPatch(const ReferencePatch& patch, const float* seen, double scale,
                       NormalEquations& sum) const {
  const float gain = static_cast<float>(brightness_.gain);
  const float offset = static_cast<float>(brightness_.offset);
  const Pixels v = Pixels::Map(patch.value.data());
  const Pixels gx = Pixels::Map(patch.gx.data()), gy = Pixels::Map(patch.gy.data());
  const Pixels r = Pixels::Map(seen) - (gain * v + (kMiddle + offset));
  Pixels w = Pixels::Ones();
  if (options_.align_robust) {
    const float limit = static_cast<float>(kHuber * scale);
    w = limit / r.abs().max(limit);
  }
  const Pixels wx = w * gx, wy = w * gy, wv = w * v, wr = w * r;
  const float xx = (wx * gx).sum(), xy = (wx * gy).sum(), yy = (wy * gy).sum();
  const float xr = (wx * r).sum(), yr = (wy * r).sum();
  const float xv = (wx * v).sum(), yv = (wy * v).sum(), x1 = wx.sum(), y1 = wy.sum();
  const float vv = (wv * v).sum(), v1 = wv.sum(), w1 = w.sum(), vr = (wv * r).sum();
  const float r1 = wr.sum(), rr = (wr * r).sum();
  Matrix2d G;
  G << xx, xy, xy, yy;
  const double g = brightness_.gain;
  sum.H.topLeftCorner<6, 6>().noalias() += g * g * patch.J.transpose() * G * patch.J;
  sum.g.head<6>().noalias() += g * patch.J.transpose() * Vector2d(xr, yr);
  sum.H.block<6, 1>(0, 6).noalias() += g * patch.J.transpose() * Vector2d(xv, yv);
  sum.H.block<6, 1>(0, 7).noalias() += g * patch.J.transpose() * Vector2d(x1, y1);
  sum.H(6, 6) += static_cast<double>(vv);
  sum.H(6, 7) += static_cast<double>(v1);
  sum.H(7, 7) += static_cast<double>(w1);
  sum.g[6] += static_cast<double>(vr);
  sum.g[7] += static_cast<double>(r1);
  sum.squares += static_cast<double>(rr);
  ++sum.patches;
}

NormalEquations Aligner::linearise(int level, const SE3& T, double scale) const {
  NormalEquations sum;
  std::array<float, kArea> seen;
  for (const ReferencePatch& patch : patches_) {
    const auto u = patch.seen ? camera_.project(T * patch.p_reference) : std::nullopt;
    if (u && sampleBlock<kSize>(current_.level(level), toLevel(*u, level), seen.data()))
      addPatch(patch, seen.data(), scale, sum);
  }
  return sum;
}

Vector8d Aligner::solve(NormalEquations equations) const {
  Matrix8d& H = equations.H;
  H(6, 6) += kGainPrior;
  H(7, 7) += kOffsetPrior;
  H.bottomLeftCorner<2, 6>() = H.topRightCorner<6, 2>().transpose();
  H(7, 6) = H(6, 7);
  if (options_.align_affine) return H.ldlt().solve(equations.g);
  Vector8d step = Vector8d::Zero();
  step.head<6>() = H.topLeftCorner<6, 6>().ldlt().solve(equations.g.head<6>());
  return step;
}

bool Aligner::alignLevel(int level, SparseAlignment& state) {
  cutPatches(level);
  SE3 T = state.T_current_reference, before = T;
  Brightness brightness_before = brightness_;
  const double scale = std::max(kSmallestScale, 1.5 * medianDifference(level, T));
  double last_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= options_.align_iterations; ++i) {
    const NormalEquations equations = linearise(level, T, scale);
    const double cost = equations.squares / (kArea * std::max(1, equations.patches));
    const bool worse = i > 0 && !(cost < last_cost);
    if (equations.patches < kFewest || worse) {
      if (i == 0) return false;
      T = before;
      brightness_ = brightness_before;
      break;
    }
    last_cost = cost;
    state.patches = equations.patches;
    state.rms = std::sqrt(cost);
    const Vector8d step = solve(equations);
    if (i == options_.align_iterations || !step.allFinite()) break;
    before = T;
    brightness_before = brightness_;
    // The point moves in the reference: p <- Exp(xi) p; the inverse step moves the camera.
    T = T * exp(-step.head<6>());
    brightness_.gain += step[6];
    brightness_.offset += step[7];
    if (step.head<3>().norm() < kSettledM && step.segment<3>(3).norm() < kSettledRad) break;
  }
  state.T_current_reference = T;
  return true;
}

}  // namespace

std::optional<SparseAlignment> alignSparsely(const Camera& camera, const TrackedFrame& reference,
                                             const ImagePyramid& current,
                                             const SE3& T_current_reference,
                                             const VoOptions& options) {
  Aligner aligner(camera, reference, current, options);
  SparseAlignment state{T_current_reference};
  const int last = std::min(current.levels(), reference.pyramid->levels()) - 1;
  const int fine = std::min(options.align_fine_level, last);
  bool aligned = false;
  for (int level = std::min(options.align_coarse_level, last); level >= fine; --level)
    aligned = aligner.alignLevel(level, state) || aligned;
  if (!aligned || !state.T_current_reference.isFinite()) return std::nullopt;
  return state;
}

}  // namespace diorama::vo
