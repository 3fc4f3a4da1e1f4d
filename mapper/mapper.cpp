#include "mapper/mapper.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "mapper/graph_solver.h"

namespace diorama {
namespace {

RobustKernel kernelOf(const std::string& name, double width) {
  const std::optional<RobustKernel::Kind> kind = kernelFromString(name);
  DIORAMA_CHECK(kind);
  return {*kind, width};
}

}  // namespace

std::optional<std::string> MapperOptions::problem() const {
  for (const auto& [key, kernel] :
       {std::pair{"object_kernel", object_kernel}, std::pair{"odometry_kernel", odometry_kernel}})
    if (!kernelFromString(kernel))
      return std::string(key) + " cannot be `" + kernel +
             "`; possible: none, huber, cauchy, cauchy_tail";
  return std::nullopt;
}

class Mapper::Impl {
 public:
  explicit Impl(const MapperOptions& options)
      : options_(options),
        smoother_(options_.smoother, kernelOf(options_.object_kernel, options_.object_kernel_width),
                  kernelOf(options_.odometry_kernel, options_.odometry_kernel_width)),
        landmarks_(options_.gate) {}

  void setSymmetries(const std::string& object, const Symmetries& symmetries) {
    symmetries_[object] = symmetries;
    landmarks_.setSymmetries(object, symmetries);
  }

  bool started() const { return smoother_.poseCount() > 0; }

  void start(int64_t timestamp_ns) {
    smoother_.start(timestamp_ns);
    landmarks_ = Landmarks(options_.gate);
    for (const auto& [object, symmetries] : symmetries_)
      landmarks_.setSymmetries(object, symmetries);
  }

  AddResult addOdometry(const OdometryMeasurement& measurement) {
    if (!started()) return {false, "the map has not been started"};
    if (measurement.from_ns != newest_ns())
      return {false, "the odometry does not begin at the newest pose"};
    if (measurement.to_ns <= measurement.from_ns) return {false, "time does not increase"};
    const OdometryFactorResult result =
        makeOdometryFactor(measurement, options_.odometry_sigma_scale);
    if (!result.factor) return {false, result.reason};
    smoother_.addPose(measurement.to_ns, *result.factor);
    return {true};
  }

  AddResult addGap(int64_t timestamp_ns) {
    if (!started()) return {false, "the map has not been started"};
    if (timestamp_ns <= newest_ns()) return {false, "time does not increase"};
    const double seconds = 1e-9 * static_cast<double>(timestamp_ns - newest_ns());
    smoother_.addPose(timestamp_ns, makeGapFactor(seconds, options_.gap_m_s, options_.gap_rad_s));
    return {true};
  }

  AddResult addObject(const ObjectMeasurement& measurement) {
    const std::optional<size_t> pose = findInWindow(measurement.timestamp_ns);
    if (!pose) return {false, "no pose of the window has that time"};
    const ObjectFactorResult result = makeObjectFactor(measurement, 0, options_.object_sigma_scale);
    if (!result.factor) return {false, result.reason};
    return landmarks_.add(smoother_, *pose, measurement.object, *result.factor);
  }

  void doubt(const std::string& object) { landmarks_.doubt(object); }

  MapEstimate update() {
    DIORAMA_CHECK(started());
    smoother_.update();
    return estimate();
  }

  MapEstimate finish() {
    DIORAMA_CHECK(started());
    smoother_.sweep();
    Graph graph = smoother_.estimate();
    if (graph.poses.size() > 1 && solve(graph, options_.batch_iterations).usable)
      smoother_.moveTo(graph);
    return estimate();
  }

  MapEstimate estimate() const {
    DIORAMA_CHECK(started());
    MapEstimate map{newest_ns(), T_world_camera(), {}};
    for (const std::string& label : landmarks_.labels()) {
      const size_t object = *landmarks_.best(label);
      map.objects.push_back(
          {label, smoother_.T_world_object(object), smoother_.covarianceWith(object).object});
    }
    return map;
  }

  // T_camera_object = T_world_camera^-1 T_world_object:
  //   its right perturbation is xi_object - Ad(T_object_camera) xi_camera.
  std::optional<ObjectPrediction> predict(const std::string& name) const {
    const std::optional<size_t> object = landmarks_.best(name);
    if (!object) return std::nullopt;
    const SE3 T_camera_object = T_world_camera().inverse() * smoother_.T_world_object(*object);
    const Matrix6d H = -adjoint(T_camera_object.inverse());
    const ChainSmoother::PairCovariance joint = smoother_.covarianceWith(*object);
    const Matrix6d cross = H * joint.cross;
    const Matrix6d P = H * joint.camera * H.transpose() + cross + cross.transpose() + joint.object;
    return ObjectPrediction{T_camera_object, 0.5 * (P + P.transpose())};
  }

  Trajectory trajectory() const {
    Trajectory trajectory;
    for (size_t k = 0; k < smoother_.poseCount(); ++k)
      trajectory.poses.push_back({smoother_.timestamp_ns(k), smoother_.T_world_camera(k)});
    return trajectory;
  }

 private:
  size_t newest() const { return smoother_.poseCount() - 1; }
  int64_t newest_ns() const { return smoother_.timestamp_ns(newest()); }
  SE3 T_world_camera() const { return smoother_.T_world_camera(newest()); }

  std::optional<size_t> findInWindow(int64_t timestamp_ns) const {
    for (size_t k = smoother_.poseCount(); k-- > 0 && smoother_.inWindow(k);)
      if (smoother_.timestamp_ns(k) == timestamp_ns) return k;
    return std::nullopt;
  }

  MapperOptions options_;
  ChainSmoother smoother_;
  Landmarks landmarks_;
  std::map<std::string, Symmetries> symmetries_;
};

Mapper::Mapper(const MapperOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Mapper::~Mapper() = default;
Mapper::Mapper(Mapper&&) noexcept = default;
Mapper& Mapper::operator=(Mapper&&) noexcept = default;

void Mapper::setSymmetries(const std::string& object, const Symmetries& symmetries) {
  impl_->setSymmetries(object, symmetries);
}
void Mapper::start(int64_t timestamp_ns) { impl_->start(timestamp_ns); }
bool Mapper::started() const { return impl_->started(); }
AddResult Mapper::addOdometry(const OdometryMeasurement& m) { return impl_->addOdometry(m); }
AddResult Mapper::addGap(int64_t timestamp_ns) { return impl_->addGap(timestamp_ns); }
AddResult Mapper::addObject(const ObjectMeasurement& m) { return impl_->addObject(m); }
void Mapper::doubt(const std::string& object) { impl_->doubt(object); }
MapEstimate Mapper::update() { return impl_->update(); }
MapEstimate Mapper::estimate() const { return impl_->estimate(); }
std::optional<ObjectPrediction> Mapper::predict(const std::string& object) const {
  return impl_->predict(object);
}
MapEstimate Mapper::finish() { return impl_->finish(); }
Trajectory Mapper::smoothedTrajectory() const { return impl_->trajectory(); }

}  // namespace diorama
