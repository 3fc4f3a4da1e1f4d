#include "tracker/edge_templates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <iterator>
#ifdef __AVX2__
#include <immintrin.h>
#endif

#include "tracker/pose_solver.h"
#include "tracker/view_sphere.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // without AVX such values pass through memory: fine
namespace diorama {
namespace {

// Templates are made from so many diameters away; at other distances the perspective differs, but
// by less than the search tolerates.
constexpr double kViewDistance = 2.5;
constexpr int kPlaces = 2;        // kept of one template
constexpr int kFewestPoints = 8;  // of a template, as the options have it

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

constexpr int kBlock = ChamferMaps::kBlock;

// kBlock neighbours at once: vectors of the compiler. Averages are rounded upwards.
using Block = uint8_t __attribute__((vector_size(kBlock)));

Block blockAt(const uint8_t* p) {
  Block b;
  std::memcpy(&b, p, sizeof b);
  return b;
}

Block average(Block a, Block b) {
#ifdef __AVX2__
  return reinterpret_cast<Block>(
      _mm256_avg_epu8(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
#else
  return (a | b) - (((a ^ b) >> 1) & 0x7f);
#endif
}

// The mean over n places, a power of two: averages of averages.
template <int n>
Block meanOf(const uint8_t* const* places, std::ptrdiff_t offset) {
  if constexpr (n == 1)
    return blockAt(places[0] + offset);
  else
    return average(meanOf<n / 2>(places, offset), meanOf<n / 2>(places + n / 2, offset));
}

Block meanOf(const uint8_t* const* places, size_t n, std::ptrdiff_t offset) {
  if (n == kFewestPoints) return meanOf<kFewestPoints>(places, offset);
  return average(meanOf(places, n / 2, offset), meanOf(places + n / 2, n / 2, offset));
}

uint8_t lowestOf(const std::vector<uint8_t>& values) {
  uint8_t lowest = UINT8_MAX;
  for (const uint8_t value : values) lowest = std::min(lowest, value);
  return lowest;
}

// A stable order by score, and no more than so many.
template <class T>
void keepBest(std::vector<T>& candidates, int most) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const T& a, const T& b) { return a.score < b.score; });
  if (candidates.size() > static_cast<size_t>(most)) candidates.resize(static_cast<size_t>(most));
}

Eigen::Quaterniond aboutZ(double angle) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitZ()));
}

}  // namespace

EdgeTemplates::EdgeTemplates(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                             int object, const TrackerOptions& tracker_options,
                             const TemplateOptions& options, const std::vector<DatabaseLook>& looks)
    : model_(model),
      camera_(camera),
      options_(options),
      search_(model, camera, rays, object, tracker_options),
      diameter_(model.diameter) {
  if (arePlain(looks))
    std::transform(looks.begin(), looks.end(), std::back_inserter(colors_), coarser);
  else
    for (const DatabaseLook& look : looks) {
      looks_.push_back(isPlain(look) ? DatabaseLook{look.direction, 0, {}, {}, {}} : look);
      coarse_looks_.push_back(coarser(looks_.back()));
    }
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
  std::vector<Point> points;
  for (const int sample : samples)
    if (const auto line = search.projectSample(view.T_camera_model, R, sample))
      points.push_back({(line->u_px - centre).cwiseQuotient(focal), line->normal});
  // Always as many: a few may be taken twice.
  const size_t wanted = std::bit_floor(static_cast<size_t>(options_.points));
  if (points.size() < wanted / 2) return;
  for (size_t k = 0; k < wanted; ++k) view.points.push_back(points[k * points.size() / wanted]);
  templates_.push_back(std::move(view));
}

// Adds the best places of one template.
void EdgeTemplates::slide(const ChamferMaps& maps, Placed placed, Scratch& scratch,
                          std::vector<Placed>& best) const {
  const Template& view = templates_[placed.view];
  const double scale = kViewDistance * diameter_ / placed.distance * camera_.fx() /
                       (maps.cell() * ChamferMaps::kCoarse);
  const Eigen::Rotation2Dd turn(placed.roll_rad);
  scratch.places.clear();
  for (const Point& point : view.points) {
    const Vector2d offset = scale * (turn * point.offset);
    const auto cells = [](double x) {
      constexpr double most = ChamferMaps::kBorder;
      return static_cast<int>(std::lround(std::clamp(x, -most, most)));
    };
    scratch.places.push_back(maps.coarse(ChamferMaps::directionOf(turn * point.normal),
                                         cells(offset.x()), cells(offset.y())));
  }
  const int width = maps.coarseWidth(), height = maps.coarseHeight();
  const int stride = (width + kBlock - 1) / kBlock * kBlock;
  std::vector<uint8_t>& means = scratch.means;
  means.resize(static_cast<size_t>(stride) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    uint8_t* const row = means.data() + static_cast<std::ptrdiff_t>(y) * stride;
    for (int x = 0; x < stride; x += kBlock) {
      const Block mean =
          meanOf(scratch.places.data(), scratch.places.size(), y * maps.coarseStride() + x);
      std::memcpy(row + x, &mean, sizeof mean);
    }
    std::fill(row + width, row + stride, uint8_t{UINT8_MAX});
  }
  for (int k = 0; k < kPlaces; ++k) {
    const uint8_t lowest = lowestOf(means);
    // Many bytes at once, unlike std::find.
    const void* const found = std::memchr(means.data(), lowest, means.size());
    const int at = static_cast<int>(static_cast<const uint8_t*>(found) - means.data());
    placed.x = at % stride;
    placed.y = at / stride;
    placed.ratio = lowest / double{ChamferMaps::kChance};
    best.push_back(placed);
    // Its neighbourhood is done with.
    constexpr int kNear = 4;
    for (int y = std::max(0, placed.y - kNear); y < std::min(height, placed.y + kNear + 1); ++y)
      for (int x = std::max(0, placed.x - kNear); x < std::min(width, placed.x + kNear + 1); ++x)
        means[static_cast<size_t>(y * stride + x)] = UINT8_MAX;
  }
}

std::vector<EdgeTemplates::Placed> EdgeTemplates::place(const ChamferMaps& maps) const {
  std::vector<Placed> best;
  if (maps.coarseWidth() == 0 || maps.coarseHeight() == 0) return best;
  Scratch scratch;
  const double step = options_.roll_rad > 0 ? options_.roll_rad : 1;
  for (size_t view = 0; view < templates_.size(); ++view)
    for (double distance = options_.nearest_diameters; distance <= options_.farthest_diameters;
         distance *= options_.distance_ratio)
      for (double roll = -options_.roll_rad; roll <= options_.roll_rad + 1e-9; roll += step)
        slide(maps, {view, roll, distance * diameter_, 0, 0, 0}, scratch, best);
  std::stable_sort(best.begin(), best.end(),
                   [](const Placed& a, const Placed& b) { return a.ratio < b.ratio; });
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

double EdgeTemplates::scoreOf(const SE3& T, double ratio, const Sight& sight) const {
  if (!colors_.empty()) {
    constexpr double kWeight = 0.2;  // of colours against a look
    const auto colors =
        compareColors(colors_, sight.means, camera_, T, model_.centre_object, options_.look_points);
    return ratio - kWeight * options_.look_weight * colors.value_or(0);
  }
  if (!sight.part_cost) {
    const auto look = compareLooks(coarse_looks_, sight.means, camera_, T, model_.centre_object,
                                   options_.look_points);
    return ratio - options_.look_weight * look.value_or(0);
  }
  const PartialLook look =
      compareLooksInPart(coarse_looks_, sight.means, camera_, T, model_.centre_object,
                         *sight.part_cost, options_.look_points);
  return ratio -
         options_.look_weight * (look.agreement.value_or(0) - *sight.part_cost * (1 - look.share));
}

// First by large patches, which tell the way from further off.
EdgeTemplates::Candidate EdgeTemplates::refine(const SE3& T_camera_object,
                                               const Sight& sight) const {
  const SE3 T_model_object{Eigen::Quaterniond::Identity(), -model_.centre_object};
  SE3 T = T_camera_object * T_model_object.inverse();
  constexpr int kSamples = 80, kLookPoints = 100;
  SolverLimits limits;
  limits.iterations = 4;
  limits.model_diameter = diameter_;
  double ratio = 1;
  for (const auto* looks : {&coarse_looks_, &looks_}) {
    const std::vector<int> samples = search_.visibleSamples(T, kSamples);
    ChamferCue edges(model_, search_, camera_, sight.edges, samples);
    LookCue look(nearestLook(*looks, T * T_model_object, model_.centre_object), sight.means,
                 camera_, model_.centre_object, kLookPoints);
    Cue* const cues[] = {&edges, &look};
    T = solvePose(T, cues, limits).T_camera_model;
    edges.linearise(T);
    ratio = edges.ratio();
  }
  return {T * T_model_object, ratio, scoreOf(T * T_model_object, ratio, sight)};
}

std::vector<EdgeSearch::Line> EdgeTemplates::draw(const SE3& T_camera_object) const {
  const SE3 T = T_camera_object * SE3{Eigen::Quaterniond::Identity(), model_.centre_object};
  const Matrix3d R = T.rotationMatrix();
  std::vector<EdgeSearch::Line> lines;
  for (const int sample : search_.visibleSamples(T))
    if (const auto line = search_.projectSample(T, R, sample)) lines.push_back(*line);
  return lines;
}

bool EdgeTemplates::areDrawnAlike(const SE3& T_camera_object, const SE3& other) const {
  using Lines = std::vector<EdgeSearch::Line>;
  constexpr double kAlike = 0.02, kOf = 0.9;  // of the object's size, and of its lines
  const Lines a = draw(T_camera_object), b = draw(other);
  const double near_px = kAlike * camera_.fx() * diameter_ / T_camera_object.translation.z();
  const auto share = [&](const Lines& of, const Lines& in) {
    const auto n = std::count_if(of.begin(), of.end(), [&](const EdgeSearch::Line& line) {
      return std::any_of(in.begin(), in.end(), [&](const EdgeSearch::Line& l) {
        const Vector2d apart = l.u_px - line.u_px;
        return apart.norm() < 4 * near_px && std::abs(apart.dot(line.normal)) < near_px;
      });
    });
    return static_cast<double>(n) / static_cast<double>(std::max<size_t>(1, of.size()));
  };
  return share(a, b) >= kOf && share(b, a) >= kOf;
}

std::vector<EdgeTemplates::Candidate> EdgeTemplates::choose(const std::vector<Placed>& places,
                                                            const Sight& sight) const {
  const SE3 T_model_object{Eigen::Quaterniond::Identity(), -model_.centre_object};
  std::vector<Candidate> candidates;
  for (const Placed& placed : places) {
    const auto T = poseOf(placed, sight.edges);
    if (!T) continue;
    const SE3 T_camera_object = *T * T_model_object;
    candidates.push_back(
        {T_camera_object, placed.ratio, scoreOf(T_camera_object, placed.ratio, sight)});
  }
  keepBest(candidates, options_.refined);
  for (Candidate& candidate : candidates) candidate = refine(candidate.T_camera_object, sight);
  keepBest(candidates, options_.refined);
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

#pragma GCC diagnostic pop
