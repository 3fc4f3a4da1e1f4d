#include "app/object_stage.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "app/stopwatch.h"
#include "core/errors.h"

namespace diorama {
namespace {

// Poses are given by hand or by another program, which the image then corrects where it knows
// better: it does not know how a tin is turned.
ObjectPrediction givenStart(const SE3& T_camera_object) {
  constexpr double kSigma_m = 0.01, kSigma_rad = 0.035;
  ObjectPrediction start{T_camera_object};
  start.covariance.diagonal() << Vector3d::Constant(kSigma_m * kSigma_m),
      Vector3d::Constant(kSigma_rad * kSigma_rad);
  start.independent = true;
  return start;
}

}  // namespace

ObjectStage::ObjectStage(PipelineObject parts, size_t number, Method method, bool detected,
                         const PipelineOptions& options)
    : parts_(std::move(parts)),
      number_(number),
      method_(method),
      detected_(detected),
      options_(options) {
  DIORAMA_CHECK(detected_ || parts_.initial_T_camera_object);
}

// The graph does not believe the tracker that it holds the object.
bool ObjectStage::isClaimedInVain(const Guidance& guidance) const {
  return claimed_ && guidance.rejected >= options_.reset_after_rejected;
}

bool ObjectStage::isHeld(const Guidance& guidance) const {
  return method_ != Method::kVo && claimed_ && !isClaimedInVain(guidance) && !isWanted(guidance);
}

bool ObjectStage::isWanted(const Guidance& guidance) const {
  return guidance.missed_frames % options_.search_every_frames == 0 && isMissing(guidance);
}

bool ObjectStage::isMissing(const Guidance& guidance) const {
  if (!detected_ || (first_ && parts_.initial_T_camera_object)) return false;
  if ((claimed_ && !guidance.overdue) || guidance.placed) return false;
  return guidance.overdue || !begun_ || !guidance.prediction || isVague(*guidance.prediction);
}

bool ObjectStage::isVague(const ObjectPrediction& prediction) const {
  const auto worst = [&](int first) {
    const Matrix3d block = prediction.covariance.block<3, 3>(first, first);
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(block, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
  };
  return worst(0) > options_.redetect_above_m || worst(3) > options_.redetect_above_rad;
}

void ObjectStage::note(Sighting& sighting, const char* event, double value,
                       std::string reason) const {
  sighting.events.push_back({sighting.timestamp_ns, parts_.name, event, value, std::move(reason)});
}

std::optional<ObjectPrediction> ObjectStage::findStart(const Guidance& guidance,
                                                       const std::optional<Detection>& detection,
                                                       Sighting& sighting) const {
  if (first_ && parts_.initial_T_camera_object) return givenStart(*parts_.initial_T_camera_object);
  std::optional<ObjectPrediction> start;
  if (begun_ && (!claimed_ || isClaimedInVain(guidance)) && (start = guidance.prediction))
    note(sighting, "reset", guidance.missed_frames,
         claimed_ ? "rejected by the graph; restarted from its prediction"
                  : "restarted from the graph's prediction");
  if (!detection) return start;
  note(sighting, "detected", detection->health,
       detection->inliers > 0 ? std::to_string(detection->inliers) + " features agree"
                              : "found by its edges");
  sighting.doubt = guidance.overdue;
  start = ObjectPrediction{detection->T_camera_object, detection->covariance};
  start->verified = start->independent = true;
  return start;
}

Sighting ObjectStage::track(const Frame& frame, const Guidance& guidance,
                            const std::optional<Detection>& detection) {
  const Stopwatch watch;
  Sighting sighting;
  sighting.object = number_;
  sighting.timestamp_ns = frame.timestamp_ns;
  const std::optional<ObjectPrediction> start = findStart(guidance, detection, sighting);
  if (start) {
    begun_ = true;
    sighting.start = {frame.timestamp_ns, start->T_camera_object};
  }
  if (guidance.track) {
    sighting.measurement = parts_.tracker->track(frame, start);
    noteChange(*sighting.measurement, sighting);
  }
  claimed_ = sighting.measurement && sighting.measurement->claimed;
  was_lost_ = was_lost_ || (begun_ && sighting.measurement && !claimed_);
  first_ = false;
  sighting.ms = watch.ms();
  return sighting;
}

void ObjectStage::noteChange(const ObjectMeasurement& m, Sighting& sighting) const {
  if (first_) note(sighting, "started", m.health, m.reason);
  if (m.claimed && !claimed_)
    note(sighting, was_lost_ ? "reinitialised" : "tracked", m.health, m.reason);
  if (!m.claimed && (claimed_ || (first_ && begun_))) note(sighting, "lost", m.health, m.reason);
}

}  // namespace diorama
