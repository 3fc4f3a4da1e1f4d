#include "app/odometry_relay.h"

#include <gtest/gtest.h>

#include "core/text.h"

namespace diorama {
namespace {

constexpr int64_t kStep_ns = 33'000'000;

SE3 ahead(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 0}}; }

// Steps of its own length; lost from one frame to another, and then it measures across the gap.
class Walker : public Odometry {
 public:
  Walker(double step, int begins, int lost_from = 1000, int lost_to = 1000)
      : step_(step), begins_(begins), lost_from_(lost_from), lost_to_(lost_to) {}

  std::optional<OdometryMeasurement> track(const Frame& frame) override {
    k_ = frame.index;
    if (k_ <= begins_) return std::nullopt;
    const bool lost = k_ >= lost_from_ && k_ < lost_to_;
    const int from = k_ == lost_to_ ? lost_from_ - 1 : k_ - 1;
    return OdometryMeasurement{"walker",
                               from * kStep_ns,
                               frame.timestamp_ns,
                               ahead(step_ * (k_ - from)),
                               Matrix6d::Identity(),
                               lost ? 0.0 : 1.0};
  }
  void update(std::span<const ObjectMeasurement>) override { updated_ = true; }
  bool started() const override { return updated_ && k_ >= begins_; }
  bool wantsObjects() const override { return k_ < 3; }
  std::vector<OdometryEvent> events() const override {
    return k_ == lost_from_ ? std::vector<OdometryEvent>{{"lost", 0, "dark"}}
                            : std::vector<OdometryEvent>{};
  }

 private:
  double step_;
  int begins_, lost_from_, lost_to_, k_ = 0;
  bool updated_ = false;
};

struct Walked {
  std::vector<double> steps;  // per frame; 0 where there is none
  std::vector<std::string> events;
};

Walked walk(std::vector<OdometryRelay::Runner> runners, int frames) {
  OdometryRelay relay(std::move(runners));
  Walked walked;
  int64_t reached = -1;
  for (int k = 0; k < frames; ++k) {
    const auto m = relay.track({k, k * kStep_ns, {}, {}});
    const bool healthy = m && m->health > 0;
    if (healthy && reached >= 0) {
      EXPECT_EQ(m->from_ns, reached) << k;
    }
    walked.steps.push_back(healthy ? m->T_from_to.translation.x() : 0);
    relay.update({});
    if (healthy || (reached < 0 && relay.started())) reached = k * kStep_ns;
    EXPECT_EQ(relay.wantsObjects(), k < 3);
    for (const OdometryEvent& e : relay.events())
      walked.events.push_back(std::to_string(k) + " " + e.event + " " + e.reason);
  }
  return walked;
}

std::vector<OdometryRelay::Runner> pair(std::unique_ptr<Odometry> a, std::unique_ptr<Odometry> b) {
  std::vector<OdometryRelay::Runner> runners;
  runners.push_back({"a", std::move(a)});
  runners.push_back({"b", std::move(b)});
  return runners;
}

TEST(OdometryRelay, TheSecondCarriesOnWhereTheFirstIsLost) {
  const Walked walked =
      walk(pair(std::make_unique<Walker>(0.01, 2, 5, 8), std::make_unique<Walker>(0.02, 0)), 11);
  // The first begins in frame 2; in frame 8 it measures from frame 4, where nobody is any more.
  const std::vector<double> expected = {0,    0.02, 0.02, 0.01, 0.01, 0.02,
                                        0.02, 0.02, 0.02, 0.01, 0.01};
  for (size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(walked.steps[k], expected[k], 1e-12) << k;
  EXPECT_EQ(walked.events, (std::vector<std::string>{"3 switched to a", "5 switched to b",
                                                     "5 lost a: dark", "9 switched to a"}));
}

TEST(OdometryRelay, WhenAllAreLostTheGapIsMeasuredAcross) {
  const Walked walked = walk(
      pair(std::make_unique<Walker>(0.01, 0, 5, 8), std::make_unique<Walker>(0.02, 0, 5, 9)), 10);
  const std::vector<double> expected = {0, 0.01, 0.01, 0.01, 0.01, 0, 0, 0, 0.04, 0.01};
  for (size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(walked.steps[k], expected[k], 1e-12) << k;
}

}  // namespace
}  // namespace diorama
