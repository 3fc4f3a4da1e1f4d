#include "mapper/mapper.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "mapper/graph.h"
#include "mapper/graph_solver.h"
#include "mapper/marginal_prior.h"

namespace diorama {

std::optional<std::string> MapperOptions::problem() const {
  if (!kernelFromString(object_kernel))
    return "object_kernel cannot be `" + object_kernel +
           "`; possible: none, huber, cauchy, cauchy_tail";
  return std::nullopt;
}

class Mapper::Impl {
 public:
  explicit Impl(MapperOptions options) : options_(std::move(options)) {
    DIORAMA_CHECK(!options_.problem());
    graph_.object_kernel = {*kernelFromString(options_.object_kernel),
                            options_.object_kernel_width};
  }

  bool started() const { return !graph_.poses.empty(); }

  void start(int64_t timestamp_ns) {
    const RobustKernel kernel = graph_.object_kernel;
    graph_ = Graph{};
    graph_.object_kernel = kernel;
    graph_.poses.push_back({timestamp_ns, SE3{}, {}});
    first_ = 0;
    prior_.emplace(SE3{});
    poses_at_relinearisation_ = 1;
    changed();
  }

  AddResult addOdometry(const OdometryMeasurement& measurement) {
    if (!started()) return {false, "the map has not been started"};
    if (measurement.from_ns != newest().timestamp_ns)
      return {false, "the odometry does not begin at the newest pose"};
    if (measurement.to_ns <= measurement.from_ns) return {false, "time does not increase"};
    const OdometryFactorResult result =
        makeOdometryFactor(measurement, options_.odometry_sigma_scale);
    if (!result.factor) return {false, result.reason};
    append(measurement.to_ns, *result.factor);
    return {true, ""};
  }

  AddResult addGap(int64_t timestamp_ns) {
    if (!started()) return {false, "the map has not been started"};
    if (timestamp_ns <= newest().timestamp_ns) return {false, "time does not increase"};
    const double seconds = 1e-9 * static_cast<double>(timestamp_ns - newest().timestamp_ns);
    append(timestamp_ns, makeGapFactor(seconds, options_.gap_m_s, options_.gap_rad_s));
    return {true, ""};
  }

  AddResult addObject(const ObjectMeasurement& measurement) {
    PoseNode* pose = findInWindow(measurement.timestamp_ns);
    if (!pose) return {false, "no pose of the window has that time"};
    const size_t object = findObject(measurement.object);
    const ObjectFactorResult result =
        makeObjectFactor(measurement, object, options_.object_sigma_scale);
    if (!result.factor) return {false, result.reason};
    if (object == graph_.objects.size())
      graph_.objects.push_back(
          {measurement.object, pose->T_world_camera * measurement.T_camera_object});
    pose->objects.push_back(*result.factor);
    changed();
    return {true, ""};
  }

  // One step: let the oldest poses go, solve for the window, renew the prior where it has become a
  // bad linearisation.
  MapEstimate update() {
    DIORAMA_CHECK(started());
    const size_t window = static_cast<size_t>(options_.window_poses);
    while (graph_.poses.size() - first_ > window) marginaliseOldest();
    if (graph_.poses.size() > 1) solve(graph_, first_, &*prior_, options_.iterations);
    changed();
    if (needsRelinearisation()) solveAll();
    return estimate();
  }

  MapEstimate finish() {
    DIORAMA_CHECK(started());
    solveAll();
    return estimate();
  }

  MapEstimate estimate() const {
    DIORAMA_CHECK(started());
    MapEstimate map{newest().timestamp_ns, newest().T_world_camera, {}};
    const Belief& joint = belief();
    for (size_t j = 0; j < graph_.objects.size(); ++j) {
      const ObjectNode& object = graph_.objects[j];
      const Eigen::Index at = joint.position(j);
      map.objects.push_back({object.name, object.T_world_object, joint.P.block<6, 6>(at, at)});
    }
    return map;
  }

  // T_camera_object = T_world_camera^-1 T_world_object:
  //   its right perturbation is xi_object - Ad(T_object_camera) xi_camera.
  std::optional<ObjectPrediction> predict(const std::string& name) const {
    const size_t object = findObject(name);
    if (object == graph_.objects.size()) return std::nullopt;
    const SE3 T_camera_object =
        newest().T_world_camera.inverse() * graph_.objects[object].T_world_object;
    const Matrix6d H = -adjoint(T_camera_object.inverse());
    const Belief& joint = belief();
    const Eigen::Index at = joint.position(object);
    const Matrix6d cross = H * joint.P.block<6, 6>(0, at);
    const Matrix6d P = H * joint.P.topLeftCorner<6, 6>() * H.transpose() + cross +
                       cross.transpose() + joint.P.block<6, 6>(at, at);
    return ObjectPrediction{T_camera_object, P};
  }

  Trajectory trajectory() const {
    Trajectory trajectory;
    for (const PoseNode& pose : graph_.poses)
      trajectory.poses.push_back({pose.timestamp_ns, pose.T_world_camera});
    return trajectory;
  }

 private:
  // Joint covariance of the newest pose and the objects.
  struct Belief {
    Eigen::MatrixXd P;
    std::vector<size_t> slots;
    Eigen::Index position(size_t object) const {
      return 6 + 6 * (std::find(slots.begin(), slots.end(), object) - slots.begin());
    }
  };

  const PoseNode& newest() const { return graph_.poses.back(); }
  void changed() { belief_.reset(); }

  size_t findObject(const std::string& name) const {
    const auto found = std::find_if(graph_.objects.begin(), graph_.objects.end(),
                                    [&](const ObjectNode& object) { return object.name == name; });
    return static_cast<size_t>(found - graph_.objects.begin());
  }

  PoseNode* findInWindow(int64_t timestamp_ns) {
    for (size_t k = graph_.poses.size(); k-- > first_;)
      if (graph_.poses[k].timestamp_ns == timestamp_ns) return &graph_.poses[k];
    return nullptr;
  }

  void append(int64_t timestamp_ns, const OdometryFactor& factor) {
    graph_.poses.push_back({timestamp_ns, newest().T_world_camera * factor.Z, {}});
    graph_.odometry.push_back(factor);
    changed();
  }

  void marginaliseOldest() {
    prior_->absorbObjects(graph_, first_);
    prior_->advance(graph_, first_);
    ++first_;
  }

  bool needsRelinearisation() const {
    const double added = static_cast<double>(graph_.poses.size() - poses_at_relinearisation_);
    if (added < options_.relinearise_growth * static_cast<double>(graph_.poses.size()))
      return false;
    const MarginalPrior::Moved moved = prior_->moved(graph_, first_);
    return moved.translation_m > options_.relinearise_m ||
           moved.rotation_rad > options_.relinearise_rad;
  }

  // The optimum over all poses, and the prior linearised there.
  void solveAll() {
    if (graph_.poses.size() > 1) solve(graph_, 0, nullptr, options_.batch_iterations);
    const size_t window_begin = first_;
    first_ = 0;
    prior_.emplace(graph_.poses.front().T_world_camera);
    while (first_ < window_begin) marginaliseOldest();
    poses_at_relinearisation_ = graph_.poses.size();
    changed();
  }

  // Marches the prior to the newest pose: exact for the linearised graph.
  const Belief& belief() const {
    if (belief_) return *belief_;
    MarginalPrior root = *prior_;
    const size_t last = graph_.poses.size() - 1;
    for (size_t k = first_; k < last; ++k) {
      root.absorbObjects(graph_, k);
      root.advance(graph_, k);
    }
    root.absorbObjects(graph_, last);
    belief_ = Belief{root.covariance(graph_, last), root.slots()};
    return *belief_;
  }

  MapperOptions options_;
  Graph graph_;
  size_t first_ = 0;  // oldest pose of the window, the front of the prior
  std::optional<MarginalPrior> prior_;
  size_t poses_at_relinearisation_ = 0;
  mutable std::optional<Belief> belief_;  // computed when asked for
};

Mapper::Mapper(MapperOptions options) : impl_(std::make_unique<Impl>(std::move(options))) {}
Mapper::~Mapper() = default;
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;

void Mapper::start(int64_t timestamp_ns) { impl_->start(timestamp_ns); }
bool Mapper::started() const { return impl_->started(); }
AddResult Mapper::addOdometry(const OdometryMeasurement& m) { return impl_->addOdometry(m); }
AddResult Mapper::addGap(int64_t timestamp_ns) { return impl_->addGap(timestamp_ns); }
AddResult Mapper::addObject(const ObjectMeasurement& m) { return impl_->addObject(m); }
MapEstimate Mapper::update() { return impl_->update(); }
MapEstimate Mapper::estimate() const { return impl_->estimate(); }
std::optional<ObjectPrediction> Mapper::predict(const std::string& object) const {
  return impl_->predict(object);
}
MapEstimate Mapper::finish() { return impl_->finish(); }
Trajectory Mapper::smoothedTrajectory() const { return impl_->trajectory(); }

}  // namespace diorama
