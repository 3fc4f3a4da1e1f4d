// The gate and the landmarks: clean measurements pass as often as they should.
#include "mapper/landmarks.h"

#include <gtest/gtest.h>

#include "mapper/mapper.h"
#include "tests/mapper/wrong_measurements.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

struct GateCount {
  int measured = 0, added = 0;
  double innovation = 0;
  double share() const { return static_cast<double>(added) / measured; }
  double mean() const { return innovation / measured; }
};

// Of measurements of objects that have a landmark.
void countGate(const SyntheticGraph& graph, const MapperOptions& options, GateCount& count) {
  Mapper mapper(options);
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    if (k > 0) {
      ASSERT_TRUE(mapper.addOdometry(graph.odometry[k - 1]));
    }
    for (const ObjectMeasurement& m : graph.observations[k]) {
      const AddResult result = mapper.addObject(m);
      if (!result.innovation) continue;
      ++count.measured;
      count.added += result.added;
      count.innovation += *result.innovation;
    }
    mapper.update();
  }
}

TEST(Gate, PassesCleanMeasurementsAsOftenAsItShould) {
  GateCount count;
  for (uint64_t seed = 1; seed <= 14; ++seed) countGate(makeGraph(coarse(), seed), {}, count);
  std::printf("clean: %d measurements, %.3f%% pass, mean normalised innovation %.3f\n",
              count.measured, 100 * count.share(), count.mean());
  EXPECT_GE(count.measured, 20000);
  EXPECT_NEAR(count.share(), 0.999, 0.001);
  EXPECT_NEAR(count.mean(), 6, 0.1);
}

// Read literally it locks out good measurements, since the object's covariance shrinks.
TEST(Gate, PapersRuleIsThereForTheComparison) {
  MapperOptions options;
  options.gate.kind = "paper";
  GateCount count;
  countGate(makeGraph(coarse(), 1), options, count);
  std::printf("paper's rule: %.1f%% of clean measurements pass\n", 100 * count.share());
  EXPECT_LT(count.share(), 0.5);
  options.gate.kind = "none";
  countGate(makeGraph(coarse(), 1), options, count = {});
  EXPECT_EQ(count.added, count.measured);
}

// One object before a camera that stands still.
class OneObject {
 public:
  OneObject() { smoother_.start(0); }

  AddResult see(const SE3& T_camera_object) {
    if (frame_++ > 0) smoother_.addPose(frame_, {SE3{}, Whitening(1e4 * Matrix6d::Identity())});
    const ObjectFactor factor{0, T_camera_object, Whitening(Matrix6d::Identity() / kSigma)};
    const AddResult result = landmarks_.add(smoother_, smoother_.poseCount() - 1, "object", factor);
    smoother_.update();
    return result;
  }
  size_t places() const { return smoother_.objectCount(); }
  size_t placesInUse() const { return smoother_.joint().slots.size(); }

  static SE3 off(double sigmas) {
    return {Eigen::Quaterniond::Identity(), {sigmas * kSigma, 0, 1}};
  }

 private:
  static constexpr double kSigma = 0.01;
  int frame_ = 0;
  ChainSmoother smoother_{{}, {}, {}};
  Landmarks landmarks_{GateOptions{}};
};

// The gate turns few good measurements away, which agree with one another.
TEST(Landmarks, TheTailOfTheNoiseIsNoOtherPlace) {
  OneObject object;
  for (int k = 0; k < 1200; ++k) {
    const bool tail = k % 200 == 100;
    EXPECT_EQ(object.see(OneObject::off(tail ? 5.2 : 0)).added, !tail);
  }
  EXPECT_EQ(object.places(), 1u);
}

TEST(Landmarks, APlaceThatIsMeasuredNoMoreIsForgotten) {
  OneObject object;
  const auto see = [&](double sigmas, int times) {
    for (int i = 0; i < times; ++i) static_cast<void>(object.see(OneObject::off(sigmas)));
  };
  see(0, 100);
  see(20, 5);
  EXPECT_EQ(object.placesInUse(), 2u);
  see(0, 200);
  EXPECT_EQ(object.placesInUse(), 2u);  // 5 of 205 are no accident
  see(0, 60);
  EXPECT_EQ(object.placesInUse(), 1u);
  see(20, 5);  // and it may come back
  EXPECT_EQ(object.placesInUse(), 2u);
}

// Neighbours do not share the measurements of one thing.
TEST(Landmarks, TheLikelyPlaceTakesWhatIsInsideItsGate) {
  OneObject object;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(object.see(OneObject::off(0)));
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(object.see(OneObject::off(6)));
  EXPECT_EQ(object.placesInUse(), 2u);
  EXPECT_TRUE(object.see(OneObject::off(4)));  // nearer to the other one
  EXPECT_FALSE(object.see(OneObject::off(6)));
}

TEST(Symmetry, TurnsAMeasurementToTheNearestPose) {
  Numbers numbers(3);
  const Vector3d axis = direction(numbers);
  for (int i = 0; i < 20; ++i) {
    const SE3 expected = numbers.pose(1);
    const SE3 turn{expSO3(numbers.uniform(-3, 3) * axis), Vector3d::Zero()};
    ObjectFactor factor{0, expected * turn, {}};
    EXPECT_THAT(nearestBySymmetry(factor, expected, {{}, axis}).Z, PoseNear(expected, 1e-9, 1e-9));
    factor.Z = expected * flip();
    EXPECT_THAT(nearestBySymmetry(factor, expected, {{flip()}, {}}).Z,
                PoseNear(expected, 1e-9, 1e-9));
    // Whitened residuals keep their size.
    factor.W = Whitening(Vector6d(Vector6d::Random().cwiseAbs() + Vector6d::Ones()).asDiagonal());
    const ObjectFactor other = nearestBySymmetry(factor, expected, {{flip()}, {}});
    const Vector6d xi = 0.1 * numbers.normal6();
    const SE3 seen = factor.Z * exp(xi);
    EXPECT_NEAR((factor.W.matrix() * log(factor.Z.inverse() * seen)).norm(),
                (other.W.matrix() * log(other.Z.inverse() * (seen * flip()))).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace diorama
