#include "mapper/mapper.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/errors.h"
#include "core/text.h"
#include "mapper/graph_solver.h"
#include "mapper/moving_object.h"
#include "mapper/odometry_anchor.h"
#include "mapper/odometry_scale.h"
#include "mapper/present_view.h"

namespace diorama {
namespace {

RobustKernel kernelOf(const std::string& name, double width) {
  const std::optional<RobustKernel::Kind> kind = kernelFromString(name);
  DIORAMA_CHECK(kind);
  return {*kind, width};
}

OdometryAnchor anchorOf(const MapperOptions& options) {
  return {options.odometry_memory_s, options.odometry_sigma_scale, options.gate.chi_square};
}

OdometryScale scaleOf(const MapperOptions& options) {
  return {options.odometry_scale_sigma, options.odometry_scale_sigma_elsewhere};
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
        landmarks_(options_.gate),
        anchor_(anchorOf(options_)),
        scale_(scaleOf(options_)),
        watch_(options_.motion) {}

  void setSymmetries(const std::string& object, const Symmetries& symmetries) {
    symmetries_[object] = symmetries;
    landmarks_.setSymmetries(object, symmetries);
    watch_.setSymmetries(object, symmetries);
  }

  bool started() const { return smoother_.poseCount() > 0; }

  void start(int64_t timestamp_ns) {
    smoother_.start(timestamp_ns);
    landmarks_ = Landmarks(options_.gate);
    for (const auto& [object, symmetries] : symmetries_)
      landmarks_.setSymmetries(object, symmetries);
    anchor_ = anchorOf(options_);
    scale_ = scaleOf(options_);
    watch_.start(timestamp_ns);
    moving_.clear();
    accepted_.clear();
  }

  AddResult addOdometry(const OdometryMeasurement& measurement) {
    if (!started()) return {false, "the map has not been started"};
    const bool across_gap = gap_ && measurement.from_ns == gap_->began_ns;
    if (measurement.from_ns != newest_ns() && !across_gap)
      return {false, "the odometry does not begin at the newest pose"};
    if (measurement.to_ns <= newest_ns()) return {false, "time does not increase"};
    OdometryFactorResult result = makeOdometryFactor(measurement, options_.odometry_sigma_scale);
    if (!result.factor) return {false, result.reason};
    const std::string& mapped = options_.odometry_with_map;
    const bool has_map = mapped.empty() || mapped == measurement.source;
    const bool elsewhere = !landmarks_.labels().empty() && !looksAtLandmark();
    const bool up_to_scale = measurement.up_to_scale;
    if (has_map || up_to_scale)
      result.factor->scale = scale_.next(smoother_, measurement, elsewhere, gap_ && !across_gap);
    if (across_gap) {
      closeGap(measurement.to_ns, *result.factor);
      watch_.breakOff(measurement.to_ns);
    } else {
      smoother_.addPose(measurement.to_ns, *result.factor);
      anchor_.addStep(smoother_, measurement, has_map && !up_to_scale && looksAtLandmark(),
                      scale_.estimate(smoother_));
      if (up_to_scale)  // no way to tell what moves
        watch_.breakOff(measurement.to_ns);
      else
        watch_.addStep(measurement);
    }
    if (gap_) smoother_.release(gap_->anchor);
    gap_.reset();
    return {true};
  }

  AddResult addGap(int64_t timestamp_ns, const SE3& T_from_to) {
    if (!started()) return {false, "the map has not been started"};
    if (timestamp_ns <= newest_ns()) return {false, "time does not increase"};
    if (!gap_) openGap();
    anchor_.release(smoother_);
    addGapPose(timestamp_ns, isUnitPose(T_from_to) ? T_from_to : SE3{});
    watch_.breakOff(timestamp_ns);
    return {true};
  }

  AddResult addObject(const ObjectMeasurement& measurement) {
    const std::optional<size_t> pose = findInWindow(measurement.timestamp_ns);
    if (!pose) return {false, "no pose of the window has that time"};
    const ObjectFactorResult result = makeObjectFactor(measurement, 0, options_.object_sigma_scale);
    if (!result.factor) return {false, result.reason};
    watch_.addSight(measurement);
    const auto moving = moving_.find(measurement.object);
    if (moving != moving_.end())
      return addMoving(moving->second, *pose, measurement, *result.factor);
    const AddResult added = landmarks_.add(smoother_, *pose, measurement.object, *result.factor);
    if (added && *pose == newest()) accepted_[measurement.object] = measurement;
    if (added && gap_ && *pose == newest()) gap_->held_ns = measurement.timestamp_ns;
    return watch_.moves(measurement.object) ? setMoving(measurement.object) : added;
  }

  bool isMoving(const std::string& object) const { return moving_.contains(object); }

  void doubt(const std::string& object) { landmarks_.doubt(object); }

  MapEstimate update() {
    DIORAMA_CHECK(started());
    smoother_.update();
    return estimate();
  }

  MapEstimate finish() {
    DIORAMA_CHECK(started());
    smoother_.sweep();
    const SE3 T_camera_world = T_world_camera().inverse();
    Graph graph = smoother_.estimate();
    if (graph.poses.size() > 1 && solve(graph, options_.batch_iterations).usable)
      smoother_.moveTo(graph);
    for (auto& [name, object] : moving_) object.carry(T_world_camera() * T_camera_world);
    return estimate();
  }

  MapEstimate estimate() const {
    DIORAMA_CHECK(started());
    MapEstimate map{newest_ns(), T_world_camera(), {}};
    for (const std::string& label : landmarks_.labels()) {
      if (const auto moving = moving_.find(label); moving != moving_.end())
        map.objects.push_back(placeInWorld(label, moving->second));
      else if (const std::optional<size_t> object = landmarks_.best(label))
        map.objects.push_back(
            {label, smoother_.T_world_object(*object), smoother_.objectCovariance(*object)});
    }
    return map;
  }

  // T_camera_object = T_world_camera^-1 T_world_object:
  //   its right perturbation is xi_object - Ad(T_object_camera) xi_camera.
  std::optional<ObjectPrediction> predict(const std::string& name) const {
    if (const auto moving = moving_.find(name); moving != moving_.end()) {
      const MovingObject::Place place = moving->second.at(newest_ns());
      return ObjectPrediction{T_world_camera().inverse() * place.T_world_object, place.covariance};
    }
    const std::optional<size_t> object = landmarks_.best(name);
    if (!object) return std::nullopt;
    const SE3 T_camera_object = T_world_camera().inverse() * smoother_.T_world_object(*object);
    const Matrix6d H = -adjoint(T_camera_object.inverse());
    const ChainSmoother::PairCovariance joint = smoother_.covarianceWith(*object);
    const Matrix6d cross = H * joint.cross;
    const Matrix6d P = H * joint.camera * H.transpose() + cross + cross.transpose() + joint.object;
    return ObjectPrediction{T_camera_object, 0.5 * (P + P.transpose())};
  }

  // The chain of one that moves takes measurements for what they say already.
  std::optional<ObjectPrediction> view(const std::string& name) const {
    std::optional<ObjectPrediction> believed = predict(name);
    const auto seen = accepted_.find(name);
    if (!believed || isMoving(name) || seen == accepted_.end() ||
        seen->second.timestamp_ns != newest_ns())
      return believed;
    const ObjectFactorResult measured = makeObjectFactor(seen->second, 0, 1);
    if (!measured.factor) return believed;
    const auto symmetries = symmetries_.find(name);
    const ObjectFactor nearest =
        symmetries == symmetries_.end()
            ? *measured.factor
            : nearestBySymmetry(*measured.factor, believed->T_camera_object, symmetries->second);
    return joinMeasurement(*believed, nearest.Z, covarianceOf(nearest), options_.gate.chi_square);
  }

  Trajectory trajectory() const {
    Trajectory trajectory;
    for (size_t k = 0; k < smoother_.poseCount(); ++k)
      trajectory.poses.push_back({smoother_.timestamp_ns(k), smoother_.T_world_camera(k)});
    return trajectory;
  }

 private:
  struct Gap {
    int64_t began_ns = 0;
    int64_t held_ns = 0;  // the newest time at which the map knew where the camera is, by an object
    size_t anchor = 0;    // the pose where it began, as something that later poses see
  };

  // The odometry may find the camera again and measure the way from where it lost it: a factor
  // between that pose and a later one. For the smoother, which knows none between poses that do not
  // follow one another, the pose stays at hand as an object that stands where the camera stood.
  void openGap() {
    gap_ = Gap{newest_ns(), newest_ns(), smoother_.addObject("", T_world_camera())};
    constexpr double kSameSigma = 1e-4;  // m, rad: finer than any odometry
    smoother_.addObservation(newest(),
                             {gap_->anchor, SE3{}, Whitening(Matrix6d::Identity() / kSameSigma)});
  }

  void addGapPose(int64_t timestamp_ns, const SE3& T_from_to) {
    const auto seconds = [&](int64_t to_ns) {
      return 1e-9 * static_cast<double>(to_ns - gap_->held_ns);
    };
    const double before_s = seconds(newest_ns()), after_s = seconds(timestamp_ns);
    OdometryFactor step =
        makeGapFactor(1, stepOf(options_.gap_m_s, kFarthest_m, before_s, after_s),
                      stepOf(options_.gap_rad_s, kFarthest_rad, before_s, after_s));
    step.Z = T_from_to;
    smoother_.addPose(timestamp_ns, step);
  }

  // The newer pose, put where it was measured, sees the older one:
  //   Log(Z T_to_from) = -Ad(Z) Log(Z^-1 T_from_to), so that W becomes -W Ad(Z^-1).
  void closeGap(int64_t timestamp_ns, const OdometryFactor& measured) {
    const SE3 Z = scaled(measured.Z, scale_.estimate(smoother_).s);
    addGapPose(timestamp_ns,
               T_world_camera().inverse() * smoother_.T_world_object(gap_->anchor) * Z);
    const SE3 T_to_from = Z.inverse();
    const Whitening W(-measured.W.matrix() * adjoint(T_to_from));
    smoother_.addObservation(newest(), {gap_->anchor, T_to_from, W});
  }

  // Who moves keeps moving: what is not known of the way grows with the time since the camera was
  // last held, not with its root, up to the size of a room or a turned head. The sigma of one step
  // of it.
  static constexpr double kFarthest_m = 2, kFarthest_rad = 1;
  static double stepOf(double per_s, double farthest, double before_s, double after_s) {
    constexpr double kLeast = 0.1;  // of what the step would be by itself
    const double before = std::min(per_s * before_s, farthest),
                 after = std::min(per_s * after_s, farthest);
    return std::max(std::sqrt(after * after - before * before),
                    kLeast * per_s * (after_s - before_s));
  }

  // What was seen of it since it moves is taken out of the graph, and makes a chain of its own.
  AddResult setMoving(const std::string& name) {
    const std::vector<ObjectMeasurement> seen = watch_.window(name);
    landmarks_.takeBack(smoother_, name, poseAt(seen.front().timestamp_ns));
    smoother_.update();
    watch_.setMoving(name, true);
    const auto T_world_object = [&](const ObjectMeasurement& m) {
      return smoother_.T_world_camera(poseAt(m.timestamp_ns)) * m.T_camera_object;
    };
    const ObjectMeasurement& first = seen.front();
    MovingObject object(options_.motion, first.timestamp_ns, T_world_object(first),
                        first.covariance);
    for (size_t k = 1; k < seen.size(); ++k)
      object.absorb(seen[k].timestamp_ns, T_world_object(seen[k]), seen[k].covariance, INFINITY);
    AddResult result{true};
    result.decision = "moving";
    result.reason = formatFixed(1e3 * object.speed_m_s(), 0) + " mm/s";
    moving_.emplace(name, std::move(object));
    return result;
  }

  AddResult addMoving(MovingObject& object, size_t pose, const ObjectMeasurement& measurement,
                      const ObjectFactor& factor) {
    if (measurement.timestamp_ns < object.timestamp_ns())
      return {false, "older than what is known of the moving object"};
    const SE3 T_world_camera = smoother_.T_world_camera(pose);
    const SE3 expected =
        T_world_camera.inverse() * object.at(measurement.timestamp_ns).T_world_object;
    const SE3 Z = nearestBySymmetry(factor, expected, symmetries_[measurement.object]).Z;
    const double limit = options_.gate.kind == "none" ? INFINITY : options_.gate.chi_square;
    AddResult result{true};
    result.innovation =
        object.absorb(measurement.timestamp_ns, T_world_camera * Z, measurement.covariance, limit);
    result.added = *result.innovation < limit;
    if (!result.added) result.reason = "not where an object that moves so can be";
    if (!result.added || !watch_.rests(measurement.object)) return result;
    moving_.erase(measurement.object);
    watch_.setMoving(measurement.object, false);
    landmarks_.settle(smoother_, pose, measurement.object, factor);
    result.decision = "resting";
    return result;
  }

  // Its error in the world is the camera's as well.
  ObjectEstimate placeInWorld(const std::string& name, const MovingObject& object) const {
    const MovingObject::Place place = object.at(newest_ns());
    const Matrix6d J = adjoint(place.T_world_object.inverse() * T_world_camera());
    return {name, place.T_world_object,
            place.covariance + J * smoother_.cameraCovariance() * J.transpose()};
  }

  // From the newest pose.
  bool looksAtLandmark() const {
    const SE3 T_camera_world = T_world_camera().inverse();
    return std::any_of(
        landmarks_.labels().begin(), landmarks_.labels().end(), [&](const std::string& label) {
          const std::optional<size_t> object = landmarks_.best(label);
          if (!object || isMoving(label)) return false;
          const Vector3d p = T_camera_world * smoother_.T_world_object(*object).translation;
          return std::atan2(p.head<2>().norm(), p.z()) < options_.odometry_view_rad;
        });
  }

  // The newest pose that is not later.
  size_t poseAt(int64_t timestamp_ns) const {
    size_t k = newest();
    while (k > 0 && smoother_.timestamp_ns(k) > timestamp_ns) --k;
    return k;
  }

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
  OdometryAnchor anchor_;
  OdometryScale scale_;
  std::optional<Gap> gap_;  // while nobody measures the motion
  MotionWatch watch_;
  std::map<std::string, MovingObject> moving_;
  std::map<std::string, ObjectMeasurement> accepted_;  // the newest of each object
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
AddResult Mapper::addGap(int64_t timestamp_ns, const SE3& T_from_to) {
  return impl_->addGap(timestamp_ns, T_from_to);
}
AddResult Mapper::addObject(const ObjectMeasurement& m) { return impl_->addObject(m); }
bool Mapper::isMoving(const std::string& object) const { return impl_->isMoving(object); }
void Mapper::doubt(const std::string& object) { impl_->doubt(object); }
MapEstimate Mapper::update() { return impl_->update(); }
MapEstimate Mapper::estimate() const { return impl_->estimate(); }
std::optional<ObjectPrediction> Mapper::predict(const std::string& object) const {
  return impl_->predict(object);
}
std::optional<ObjectPrediction> Mapper::view(const std::string& object) const {
  return impl_->view(object);
}
MapEstimate Mapper::finish() { return impl_->finish(); }
Trajectory Mapper::smoothedTrajectory() const { return impl_->trajectory(); }

}  // namespace diorama
