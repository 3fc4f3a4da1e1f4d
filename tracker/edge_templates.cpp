#include "tracker/edge_templates.h"

#include <algorithm>
#include <cmath>

#include "tracker/pose_solver.h"
#include "tracker/view_sphere.h"

namespace diorama {
namespace {

// Templates are made from so many diameters away; at other distances the perspective differs, but
// by less than the search tolerates.
constexpr double kViewDistance = 2.5;
constexpr int kPlaces = 2;  // kept of one template

// Distances to the edges for the Gauss-Newton solver.
class ChamferCue : public Cue {
 public:
  ChamferCue(const EdgeModel& model, const EdgeSearch& search, const Camera& camera,
             const ChamferMaps& maps, const std::vector<int>& samples)
      : model_(model), search_(search), camera_(camera), maps_(maps), samples_(samples) {}

  CueEquations linearise(const SE3& T) override {
    CueEquations equations;
    equations.sigma_px = 0.5 * maps_.farthestPx();
    const double information = 1 / (equations.sigma_px * equations.sigma_px);
    const Matrix3d R = T.rotationMatrix();
    double sum = 0, clutter = 0;
    for (const int index : samples_) {
      const auto line = search_.projectSample(T, R, index);
      const Vector3d& p = model_.samples[static_cast<size_t>(index)].p;
      const auto projection = camera_.projectWithJacobian(R * p + T.translation);
      if (!line || !projection) continue;
      const ChamferMaps::Sample at =
          maps_.sample(line->u_px, ChamferMaps::directionOf(line->normal));
      ++equations.residuals;
      sum += at.distance_px;
      clutter += maps_.meanDistance(line->u_px);
      // What is as far as can be says nothing about where to go.
      const double weight = 1 - at.distance_px / maps_.farthestPx();
      if (weight <= 0) continue;
      const Matrix26d J = pointJacobian(projection->J, R, p);
      equations.add((at.gradient.transpose() * J).transpose(), at.distance_px,
                    weight * information);
    }
    ratio_ = clutter > 0 ? sum / clutter : 1;
    return equations;
  }

  // Where it was linearised last: the distances over what lines of any direction have there. In
  // clutter an edge is near everywhere.
  double ratio() const { return ratio_; }

 private:
  const EdgeModel& model_;
  const EdgeSearch& search_;
  const Camera& camera_;
  const ChamferMaps& maps_;
  const std::vector<int>& samples_;
  double ratio_ = 1;
};

// sums(x, y) += map(x + dx, y + dy), and chance where that is outside.
void addShifted(const Image<uint8_t>& map, int dx, int dy, std::vector<uint16_t>& sums) {
  for (int y = 0; y < map.height; ++y) {
    uint16_t* const sum = sums.data() + static_cast<size_t>(y) * static_cast<size_t>(map.width);
    const int from = std::clamp(-dx, 0, map.width),
              to = std::clamp(map.width - dx, from, map.width);
    const bool inside = y + dy >= 0 && y + dy < map.height;
    const int first = inside ? from : map.width, last = inside ? to : map.width;
    for (int x = 0; x < first; ++x) sum[x] = static_cast<uint16_t>(sum[x] + ChamferMaps::kChance);
    if (inside) {
      const uint8_t* const row = map.row(y + dy) + dx;
      for (int x = first; x < last; ++x) sum[x] = static_cast<uint16_t>(sum[x] + row[x]);
    }
    for (int x = last; x < map.width; ++x)
      sum[x] = static_cast<uint16_t>(sum[x] + ChamferMaps::kChance);
  }
}

// In a form that is done by many at once.
uint16_t lowestOf(const std::vector<uint16_t>& values) {
  uint16_t lowest = UINT16_MAX;
  for (const uint16_t value : values) lowest = std::min(lowest, value);
  return lowest;
}

Eigen::Quaterniond aboutZ(double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
}

}  // namespace

EdgeTemplates::EdgeTemplates(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                             int object, const TrackerOptions& tracker_options,
                             const TemplateOptions& options)
    : model_(model),
      camera_(camera),
      options_(options),
      search_(model, camera, rays, object, tracker_options),
      diameter_(model.diameter) {
  const Camera studio{CameraParameters{}};
  const EdgeSearch search(model, studio, rays, object, tracker_options);
  for (const Vector3d& direction : sphereDirections(options.views))
    if (std::asin(direction.z()) >= options.lowest_view_rad) addTemplate(direction, search, studio);
}

void EdgeTemplates::addTemplate(const Vector3d& direction, const EdgeSearch& search,
                                const Camera& studio) {
  Template view;
  view.T_camera_model = viewFrom(direction, kViewDistance * diameter_, Vector3d::Zero());
  const Matrix3d R = view.T_camera_model.rotationMatrix();
  const Vector2d focal(studio.fx(), studio.fy());
  const Vector2d centre = *studio.project(Vector3d(0, 0, 1));
  const std::vector<int> samples = search.visibleSamples(view.T_camera_model);
  const size_t wanted = static_cast<size_t>(options_.points);
  for (size_t k = 0; k < std::min(samples.size(), wanted); ++k) {
    const size_t i = samples.size() <= wanted ? k : k * samples.size() / wanted;
    const auto line = search.projectSample(view.T_camera_model, R, samples[i]);
    if (line) view.points.push_back({(line->u_px - centre).cwiseQuotient(focal), line->normal});
  }
  if (view.points.size() >= wanted / 2) templates_.push_back(std::move(view));
}

// Adds the best places of one template.
void EdgeTemplates::slide(const ChamferMaps& maps, Placed placed, std::vector<uint16_t>& sums,
                          std::vector<Placed>& best) const {
  const Template& view = templates_[placed.view];
  const double scale = kViewDistance * diameter_ / placed.distance * camera_.fx() /
                       (maps.cell() * ChamferMaps::kCoarse);
  const Eigen::Rotation2Dd turn(placed.roll_rad);
  std::fill(sums.begin(), sums.end(), uint16_t{0});
  for (const Point& point : view.points) {
    const Vector2d offset = scale * (turn * point.offset);
    addShifted(maps.coarse(ChamferMaps::directionOf(turn * point.normal)),
               static_cast<int>(std::lround(offset.x())), static_cast<int>(std::lround(offset.y())),
               sums);
  }
  const int width = maps.coarse(0).width;
  for (int k = 0; k < kPlaces; ++k) {
    const uint16_t lowest = lowestOf(sums);
    const int at = static_cast<int>(std::find(sums.begin(), sums.end(), lowest) - sums.begin());
    placed.x = at % width;
    placed.y = at / width;
    placed.mean = lowest / static_cast<double>(view.points.size());
    best.push_back(placed);
    // Its neighbourhood is done with.
    constexpr int kNear = 4;
    for (int y = std::max(0, placed.y - kNear);
         y < std::min(maps.coarse(0).height, placed.y + kNear + 1); ++y)
      for (int x = std::max(0, placed.x - kNear); x < std::min(width, placed.x + kNear + 1); ++x)
        sums[static_cast<size_t>(y * width + x)] = UINT16_MAX;
  }
}

std::vector<EdgeTemplates::Placed> EdgeTemplates::place(const ChamferMaps& maps) const {
  std::vector<Placed> best;
  std::vector<uint16_t> sums(maps.coarse(0).pixels.size());
  if (sums.empty()) return best;
  const double step = options_.roll_rad > 0 ? options_.roll_rad : 1;
  for (size_t view = 0; view < templates_.size(); ++view)
    for (double distance = options_.nearest_diameters; distance <= options_.farthest_diameters;
         distance *= options_.distance_ratio)
      for (double roll = -options_.roll_rad; roll <= options_.roll_rad + 1e-9; roll += step)
        slide(maps, {view, roll, distance * diameter_, 0, 0, 0}, sums, best);
  std::stable_sort(best.begin(), best.end(),
                   [](const Placed& a, const Placed& b) { return a.mean < b.mean; });
  if (best.size() > static_cast<size_t>(options_.candidates))
    best.resize(static_cast<size_t>(options_.candidates));
  return best;
}

// The template's camera looks at the centre; here the centre lies elsewhere in the image.
std::optional<SE3> EdgeTemplates::poseOf(const Placed& placed, const ChamferMaps& maps) const {
  const double side = maps.cell() * ChamferMaps::kCoarse;
  const auto ray = camera_.unproject(
      side * Vector2d(placed.x, placed.y) +
      Vector2d::Constant((ChamferMaps::kCoarse / 2) * maps.cell() + 0.5 * (maps.cell() - 1)));
  if (!ray) return std::nullopt;
  const Vector3d direction = ray->normalized();
  const Eigen::Quaterniond towards =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), direction);
  return SE3{towards * aboutZ(placed.roll_rad) * templates_[placed.view].T_camera_model.rotation,
             placed.distance * direction};
}

EdgeTemplates::Candidate EdgeTemplates::refine(const SE3& T_camera_object,
                                               const ChamferMaps& maps) const {
  SE3 T = T_camera_object * SE3{Eigen::Quaterniond::Identity(), model_.centre_object};
  constexpr int kRounds = 2;
  SolverLimits limits;
  limits.iterations = 4;
  limits.model_diameter = diameter_;
  double ratio = 1;
  for (int round = 0; round <= kRounds; ++round) {
    const std::vector<int> samples = search_.visibleSamples(T);
    ChamferCue cue(model_, search_, camera_, maps, samples);
    Cue* const cues[] = {&cue};
    if (round < kRounds) T = solvePose(T, cues, limits).T_camera_model;
    cue.linearise(T);
    ratio = cue.ratio();
  }
  return {T * SE3{Eigen::Quaterniond::Identity(), -model_.centre_object}, ratio};
}

std::vector<EdgeTemplates::Candidate> EdgeTemplates::find(const ChamferMaps& maps,
                                                          const Plausible& plausible) const {
  const SE3 T_model_object{Eigen::Quaterniond::Identity(), -model_.centre_object};
  std::vector<Candidate> candidates;
  for (const Placed& placed : place(maps)) {
    const auto T = poseOf(placed, maps);
    if (T && plausible(*T * T_model_object))
      candidates.push_back(refine(*T * T_model_object, maps));
    if (candidates.size() == static_cast<size_t>(options_.refined)) break;
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.ratio < b.ratio; });
  // Refinement leads many to the same pose.
  std::vector<Candidate> distinct;
  for (const Candidate& c : candidates) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Candidate& d) {
      return (c.T_camera_object.translation - d.T_camera_object.translation).norm() <
                 0.03 * diameter_ &&
             angleBetween(c.T_camera_object.rotation, d.T_camera_object.rotation) < 0.05;
    });
    if (!known) distinct.push_back(c);
    if (distinct.size() == static_cast<size_t>(options_.verified)) break;
  }
  return distinct;
}

}  // namespace diorama
