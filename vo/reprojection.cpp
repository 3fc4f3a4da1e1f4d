#include "vo/reprojection.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "vo/exposure.h"
#include "vo/feature_alignment.h"

namespace diorama::vo {
namespace {

constexpr double kBorder = 8;      // px: a patch does not fit nearer to the outline
constexpr int kTrialsPerCell = 3;  // points searched for before the cell is given up

// With less of the cells found something stands before the map; of fewer cells it is not known.
constexpr double kOpenShare = 0.6;
constexpr int kFewestTried = 20;

constexpr double kAlongEdge_px = 300;  // standard deviation: nothing is known there

struct Candidate {
  MapPoint* point = nullptr;
  Vector2d u_px = Vector2d::Zero();
  int score = 0;
};

// Points that agreed often and are seen by many keyframes come first.
int scoreOf(const MapPoint& point) {
  return std::min(point.agreed, 30) + 5 * std::min(static_cast<int>(point.observations.size()), 6) -
         3 * point.failed;
}

// The best points in a cell, the best one first; of equals, the one that came first.
struct Cell {
  std::array<Candidate, kTrialsPerCell> best;
  int count = 0;

  void add(const Candidate& candidate) {
    int at = count;
    while (at > 0 && best[static_cast<size_t>(at - 1)].score < candidate.score) --at;
    if (at == kTrialsPerCell) return;
    count = std::min(count + 1, kTrialsPerCell);
    for (int i = count - 1; i > at; --i)
      best[static_cast<size_t>(i)] = best[static_cast<size_t>(i - 1)];
    best[static_cast<size_t>(at)] = candidate;
  }
};

std::vector<Cell> fillCells(const Camera& camera, const Map& map, const SE3& T_world_camera,
                            const CellGrid& grid, bool settled, bool edgelets) {
  std::vector<Cell> cells(grid.size());
  const SE3 T_camera_world = T_world_camera.inverse();
  const Matrix3d R = T_camera_world.rotationMatrix();
  for (const auto& point : map.points) {
    if (point->bad || point->settled != settled || point->edgelet != edgelets) continue;
    const auto u = camera.project(R * point->p_world + T_camera_world.translation);
    if (u && camera.contains(*u, kBorder))
      cells[grid.cellOf(*u)].add({point.get(), *u, scoreOf(*point)});
  }
  return cells;
}

// The cells in an order that spreads over the image, so that any part of it is spread, too.
std::vector<size_t> spreadOrder(size_t cells) {
  size_t stride = std::max<size_t>(1, static_cast<size_t>(0.618 * static_cast<double>(cells)));
  while (std::gcd(stride, cells) != 1) ++stride;
  std::vector<size_t> order(cells);
  for (size_t i = 0; i < cells; ++i) order[i] = i * stride % cells;
  return order;
}

std::optional<AlignedPatch> align(const Camera& camera, const TrackedFrame& frame,
                                  const Candidate& candidate, const Observation& reference,
                                  int level, int& found_level, const VoOptions& options) {
  const Keyframe& keyframe = *reference.keyframe;
  const auto patch =
      warpPatch(camera, *keyframe.pyramid, reference.u_px, level,
                keyframe.T_world_camera.inverse() * candidate.point->p_world,
                frame.T_world_camera.inverse() * keyframe.T_world_camera, frame.pyramid->levels(),
                smearOf(camera, frame, keyframe, candidate.point->p_world));
  if (!patch) return std::nullopt;
  found_level = patch->level;
  return alignFeature(frame.pyramid->level(patch->level), *patch,
                      toLevel(candidate.u_px, patch->level), options.match_radius_px,
                      options.match_gain, candidate.point->edgelet);
}

std::optional<Feature> findAt(const Camera& camera, const TrackedFrame& frame,
                              const Candidate& candidate, const Observation& reference, int level,
                              const VoOptions& options) {
  int found_level = 0;
  const auto found = align(camera, frame, candidate, reference, level, found_level, options);
  if (!found || found->rms > largestPatchRms(frame.noise, options)) return std::nullopt;
  return Feature{measuredBy(*found, found_level, options), candidate.point};
}

// At the level where it was seen, or, if motion has blurred one of the two images, a coarser one.
std::optional<Feature> find(const Camera& camera, const TrackedFrame& frame,
                            const Candidate& candidate, const VoOptions& options) {
  const Observation* reference =
      chooseReference(*candidate.point, frame.T_world_camera.translation, options);
  if (!reference) return std::nullopt;
  const int coarsest = std::min(
      frame.pyramid->levels() - 1,
      reference->level + std::max(frame.blurred_levels, reference->keyframe->blurred_levels));
  for (int level = reference->level; level <= std::max(coarsest, reference->level); ++level)
    if (const auto found = findAt(camera, frame, candidate, *reference, level, options))
      return found;
  return std::nullopt;
}

std::vector<uint8_t> occupiedBy(const TrackedFrame& frame, const CellGrid& grid) {
  std::vector<uint8_t> occupied(grid.size(), 0);
  for (const Feature& feature : frame.features) occupied[grid.cellOf(feature.u_px)] = 1;
  return occupied;
}

// Settled points in cells that are free yet, until there are `limit` features.
void addSettled(const Camera& camera, const Map& map, const CellGrid& grid, int limit,
                bool edgelets, TrackedFrame& frame, ReprojectionResult& result,
                const VoOptions& options) {
  const std::vector<uint8_t> occupied = occupiedBy(frame, grid);
  const auto cells = fillCells(camera, map, frame.T_world_camera, grid, true, edgelets);
  for (const size_t cell : spreadOrder(cells.size())) {
    if (occupied[cell] || cells[cell].count == 0) continue;
    if (static_cast<int>(frame.features.size()) >= limit) break;
    ++result.tried;
    for (int trial = 0; trial < cells[cell].count; ++trial) {
      const Candidate& candidate = cells[cell].best[static_cast<size_t>(trial)];
      if (auto feature = find(camera, frame, candidate, options)) {
        frame.features.push_back(*feature);
        break;
      }
      result.missed.push_back(candidate.point);
    }
  }
}

// In cells that are free yet. That others are not found says little, since they are searched for at
// a depth that may be wrong.
void addUnsettled(const Camera& camera, const Map& map, const CellGrid& grid, int limit,
                  bool edgelets, TrackedFrame& frame, const VoOptions& options) {
  const std::vector<uint8_t> occupied = occupiedBy(frame, grid);
  const auto cells = fillCells(camera, map, frame.T_world_camera, grid, false, edgelets);
  for (const size_t cell : spreadOrder(cells.size())) {
    if (static_cast<int>(frame.features.size()) >= limit) break;
    if (occupied[cell] || cells[cell].count == 0) continue;
    if (auto feature = find(camera, frame, cells[cell].best.front(), options))
      frame.features.push_back(*feature);
  }
}

}  // namespace

Measured measuredBy(const AlignedPatch& aligned, int level, const VoOptions& options) {
  const double floor = options.feature_sigma_px * options.feature_sigma_px;
  Matrix2d covariance = aligned.covariance + floor * Matrix2d::Identity();
  if (const Vector2d& n = aligned.normal; !n.isZero(0))
    covariance = n.dot(covariance * n) * n * n.transpose() +
                 kAlongEdge_px * kAlongEdge_px * (Matrix2d::Identity() - n * n.transpose());
  return {fromLevel(aligned.u_level, level), level, covariance * (1 << (2 * level)),
          aligned.normal};
}

Measured hostMeasurement(const Vector2d& u_px, int level, const VoOptions& options) {
  const double floor = options.feature_sigma_px * options.feature_sigma_px;
  return {u_px, level, floor * Matrix2d::Identity() * (1 << (2 * level)), Vector2d::Zero()};
}

const Observation* chooseReference(const MapPoint& point, const Vector3d& camera_world,
                                   const VoOptions& options) {
  if (point.observations.empty()) return nullptr;
  const Vector3d view = (camera_world - point.p_world).normalized();
  const auto cosineOf = [&](const Observation& o) {
    return view.dot((o.keyframe->T_world_camera.translation - point.p_world).normalized());
  };
  const Observation* best = &point.observations.front();
  double best_cosine = cosineOf(*best);
  if (best_cosine >= std::cos(options.host_view_angle_rad)) return best;
  for (const Observation& o : point.observations)
    if (const double cosine = cosineOf(o); cosine > best_cosine) {
      best = &o;
      best_cosine = cosine;
    }
  return best_cosine >= std::cos(options.max_view_angle_rad) ? best : nullptr;
}

ReprojectionResult reprojectMap(const Camera& camera, const Map& map, TrackedFrame& frame,
                                const VoOptions& options) {
  const CellGrid grid(camera.width(), camera.height(), options.cell_px);
  frame.features.clear();
  ReprojectionResult result;
  addSettled(camera, map, grid, options.max_features, false, frame, result, options);
  const int found = static_cast<int>(frame.features.size());
  frame.covered = result.tried >= kFewestTried && found < kOpenShare * result.tried;
  const int limit = frame.covered ? options.unsettled_below : options.unsettled_open;
  if (found < options.edgelets_below)
    addSettled(camera, map, grid, options.edgelets_below, true, frame, result, options);
  if (found < limit) addUnsettled(camera, map, grid, limit, false, frame, options);
  if (found < options.edgelets_below)
    addUnsettled(camera, map, grid, std::min(limit, options.edgelets_below), true, frame, options);
  result.matched = static_cast<int>(frame.features.size());
  return result;
}

std::optional<double> patchDifference(const Camera& camera, const TrackedFrame& frame,
                                      const Feature& feature, const VoOptions& options) {
  const Observation* reference =
      chooseReference(*feature.point, frame.T_world_camera.translation, options);
  if (!reference) return std::nullopt;
  int found_level = 0;
  const auto found = align(camera, frame, {feature.point, feature.u_px, 0}, *reference,
                           reference->level, found_level, options);
  if (!found) return std::nullopt;
  return found->rms;
}

void measureAll(const Camera& camera, const Map& map, TrackedFrame& frame,
                const VoOptions& options) {
  frame.features.clear();
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  for (const auto& point : map.points) {
    const auto u = camera.project(T_camera_world * point->p_world);
    if (point->bad || !point->settled || !u || !camera.contains(*u, kBorder)) continue;
    if (auto feature = find(camera, frame, {point.get(), *u, 0}, options))
      frame.features.push_back(*feature);
  }
}

}  // namespace diorama::vo
