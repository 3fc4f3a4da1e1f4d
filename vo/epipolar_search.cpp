#include "vo/epipolar_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "vo/exposure.h"
#include "vo/feature_alignment.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr double kStepPx = 0.7;     // along the line (SVO)
constexpr int kPieceSteps = 8;      // steps for which the line counts as straight
constexpr double kShortLinePx = 2;  // alignment alone reaches along such a line
constexpr double kAlignmentReachPx = 3;
constexpr double kOffLinePx = 2;  // how far from the line a match may be, at its level
constexpr int kSize = Patch::kSize, kArea = kSize * kSize;
constexpr double kNearestM = 0.02;  // nothing is seen nearer
// Cosine between an edge's normal and the line: with less the edge lies along it.
constexpr double kLeastSlant = 0.4;

// Zero-mean sum of squared differences at whole pixels.
class ZeroMeanDifference {
 public:
  explicit ZeroMeanDifference(const Patch& patch) {
    const auto inner = patch.inner();
    for (size_t k = 0; k < kArea; ++k) {
      values_[k] = static_cast<int16_t>(inner[k] + 0.5f);
      sum_ += values_[k];
      squares_ += values_[k] * values_[k];
    }
  }

  double at(const Image<uint8_t>& image, int x, int y) const {
    // Copied first, and of 16 bits: one instruction multiplies and adds up pairs of these.
    std::array<uint8_t, kArea> bytes;
    for (int j = 0; j < kSize; ++j)
      std::copy_n(image.row(y - kSize / 2 + j) + x - kSize / 2, kSize,
                  &bytes[static_cast<size_t>(j * kSize)]);
    std::array<int16_t, kArea> seen;
    for (size_t k = 0; k < kArea; ++k) seen[k] = bytes[k];
    int sum = 0, squares = 0, product = 0;
    for (size_t k = 0; k < kArea; ++k) {
      sum += seen[k];
      squares += seen[k] * seen[k];
      product += seen[k] * values_[k];
    }
    const double mean = static_cast<double>(sum_ - sum);
    return squares_ - 2.0 * product + squares - mean * mean / kArea;
  }

 private:
  std::array<int16_t, kArea> values_;
  int sum_ = 0, squares_ = 0;
};

// The best whole pixel on the projected ray between two inverse depths.
std::optional<Vector2d> bestOnLine(const Image<uint8_t>& image, const ZeroMeanDifference& patch,
                                   const auto& projectAt, int steps, double worst) {
  std::optional<Vector2d> best;
  double best_cost = worst;
  int last_x = -1, last_y = -1;
  const Vector2d nowhere = Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Vector2d from = nowhere, to = nowhere;  // ends of a piece that is straight although lenses bend
  int length = 1;                         // of the piece, steps
  for (int i = 0; i <= steps; ++i) {
    const int in_piece = i % kPieceSteps;
    if (in_piece == 0) {
      length = std::clamp(steps - i, 1, kPieceSteps);
      from = i == 0 ? projectAt(0.0).value_or(nowhere) : to;
      to = projectAt(static_cast<double>(std::min(i + length, steps)) / steps).value_or(nowhere);
    }
    const Vector2d u = from + (to - from) * (static_cast<double>(in_piece) / length);
    constexpr double margin = kSize / 2 - 0.5;  // NaN is in no image
    if (!(u.x() >= margin && u.y() >= margin && u.x() < image.width - margin &&
          u.y() < image.height - margin))
      continue;
    const int x = static_cast<int>(u.x() + 0.5), y = static_cast<int>(u.y() + 0.5);
    if (x == last_x && y == last_y) continue;
    last_x = x;
    last_y = y;
    const double cost = patch.at(image, x, y);
    if (cost < best_cost) {
      best_cost = cost;
      best = Vector2d(x, y);
    }
  }
  return best;
}

// Where the edge that was found meets the projected ray: the line that is straight there through
// the ray's pixel nearest to the edgelet. At the level.
std::optional<Vector2d> meetLine(const Camera& camera, const AlignedPatch& edge, int level,
                                 const SE3& T_frame_host, const Vector3d& bearing_host) {
  const auto bearing = camera.unproject(fromLevel(edge.u_level, level));
  const auto near = bearing ? triangulate(T_frame_host, bearing_host, *bearing) : std::nullopt;
  if (!near) return std::nullopt;
  const Vector3d ray = T_frame_host.rotation * bearing_host;
  constexpr double kStep = 0.01;
  const auto u = camera.project(ray + near->inverse_depth * T_frame_host.translation);
  const auto beside =
      camera.project(ray + (1 + kStep) * near->inverse_depth * T_frame_host.translation);
  if (!u || !beside) return std::nullopt;
  const Vector2d along = (*beside - *u).normalized(), at = toLevel(*u, level);
  const double slant = edge.normal.dot(along);
  if (!(std::abs(slant) > 0.5 * kLeastSlant)) return std::nullopt;
  return at + edge.normal.dot(edge.u_level - at) / slant * along;
}

}  // namespace

std::optional<Triangulated> triangulate(const SE3& T_other_host, const Vector3d& bearing,
                                        const Vector3d& bearing_other) {
  // (R b + rho t) ~ b_other: two equations a + rho c = 0, linear in the inverse depth rho.
  const Vector3d a = T_other_host.rotation * bearing, t = T_other_host.translation;
  const Vector2d x = bearing_other.head<2>();
  const Vector2d constant = a.head<2>() - x * a.z(), slope = t.head<2>() - x * t.z();
  const double square = slope.squaredNorm();
  if (!(square > 1e-12)) return std::nullopt;
  const double rho = -constant.dot(slope) / square;
  const double z = a.z() + rho * t.z();  // depth in the other over depth in the host
  if (!(rho > 1e-3) || !(z > 0) || z / rho < kNearestM) return std::nullopt;
  return Triangulated{rho, z / std::sqrt(square), (constant + rho * slope).norm() / z};
}

namespace {

// The patch on a line of this length, in px of its level: in steps along it, unless it is short,
// and from there by alignment.
template <class ProjectAt>
std::optional<AlignedPatch> findOnLine(const TrackedFrame& frame, const Patch& patch, bool edgelet,
                                       const ProjectAt& projectAt, Vector2d start, double length,
                                       const VoOptions& options) {
  const Image<uint8_t>& image = frame.pyramid->level(patch.level);
  const double largest_rms = largestPatchRms(frame.noise, options);
  if (length > kShortLinePx) {
    // Rounding to pixels costs up to half a pixel of gradient: twice the rms is let through here.
    const double worst = kArea * 4 * largest_rms * largest_rms;
    const auto best = bestOnLine(image, ZeroMeanDifference(patch), projectAt,
                                 static_cast<int>(std::ceil(length / kStepPx)), worst);
    if (!best) return std::nullopt;
    start = *best;
  }
  auto found = alignFeature(image, patch, start, kAlignmentReachPx, options.match_gain, edgelet);
  if (found && found->rms > largest_rms) found.reset();
  return found;
}

// From where the patch was found; `along` the line, unit.
EpipolarMatch depthOf(const Camera& camera, const Corner3d& corner, AlignedPatch found, int level,
                      const SE3& T_frame_host, const Vector2d& along, const VoOptions& options) {
  double slant = 1;  // of the edge's normal against the line
  if (corner.edgelet) {
    slant = std::abs(found.normal.dot(along));
    if (slant < kLeastSlant) return {};
    if (const auto met = meetLine(camera, found, level, T_frame_host, corner.bearing))
      found.u_level = *met;
    else
      return {EpipolarOutcome::kNoMatch, {}};
  }
  const auto bearing = camera.unproject(fromLevel(found.u_level, level));
  const auto point = bearing ? triangulate(T_frame_host, corner.bearing, *bearing) : std::nullopt;
  const double focal = 0.5 * (camera.fx() + camera.fy());
  if (!point || point->error * focal * levelScale(level) > kOffLinePx)
    return {EpipolarOutcome::kNoMatch, {}};
  // An edge along the line says nothing of the depth.
  const Measured measured = measuredBy(found, level, options);
  const Vector2d across = corner.edgelet ? found.normal : along;
  const double sigma_px = std::sqrt(across.dot(measured.covariance_px2 * across)) / slant;
  return {EpipolarOutcome::kFound, {point->inverse_depth, sigma_px / focal * point->sensitivity}};
}

}  // namespace

EpipolarMatch searchEpipolar(const Camera& camera, const Corner3d& corner,
                             const TrackedFrame& frame, double low, double high,
                             const VoOptions& options) {
  const SE3 T_frame_host = frame.T_world_camera.inverse() * corner.host->T_world_camera;
  const double middle = 0.5 * (low + high);
  const Vector3d p_host = corner.bearing / middle;
  const auto patch =
      warpPatch(camera, *corner.host->pyramid, corner.u_px, corner.level, p_host, T_frame_host,
                frame.pyramid->levels(),
                smearOf(camera, frame, *corner.host, corner.host->T_world_camera * p_host));
  if (!patch) return {};
  const Vector3d ray = T_frame_host.rotation * corner.bearing;
  const auto projectAt = [&](double part) -> std::optional<Vector2d> {
    const double rho = low + part * (high - low);
    const auto u = camera.project(ray + rho * T_frame_host.translation);
    if (!u) return std::nullopt;
    return toLevel(*u, patch->level);
  };
  const auto ends = [&] { return std::pair(projectAt(0), projectAt(1)); };
  auto [begin, end] = ends();
  const auto centre = projectAt(0.5);
  if (!begin || !end || !centre) return {};
  double length = (*end - *begin).norm();
  if (length > options.max_epipolar_px) {  // the likeliest part of it
    const double share = 0.5 * options.max_epipolar_px / length;
    std::tie(low, high) = std::pair(middle - share * (high - low), middle + share * (high - low));
    std::tie(begin, end) = ends();
    if (!begin || !end) return {};
    length = (*end - *begin).norm();
  }
  if (!(length > 1e-6)) return {};

  const auto found = findOnLine(frame, *patch, corner.edgelet, projectAt, *centre, length, options);
  if (!found) return {EpipolarOutcome::kNoMatch, {}};
  return depthOf(camera, corner, *found, patch->level, T_frame_host, (*end - *begin).normalized(),
                 options);
}

}  // namespace diorama::vo
