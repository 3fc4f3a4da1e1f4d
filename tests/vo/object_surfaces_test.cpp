#include "vo/object_surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace diorama::vo {
namespace {

// A square plate of 20 cm in the plane z = 0, and behind it, as object 1, another ten times as
// wide.
class Plates : public RayQuery {
 public:
  void occluded(int, const Vector3d&, std::span<const Vector3d>,
                std::span<uint8_t>) const override {}
  std::optional<RayHit> closestHit(int object, const Vector3d& origin,
                                   const Vector3d& direction) const override {
    const double t = -origin.z() / direction.z();
    const Vector3d p = origin + t * direction;
    const double half = object == 0 ? 0.1 : 1;
    if (!(t > 0 && std::abs(p.x()) < half && std::abs(p.y()) < half)) return std::nullopt;
    return RayHit{p, Vector3d(0, 0, -1)};
  }
};

const Camera kCamera{CameraParameters{CameraModel::kPinhole, 640, 480, 500, 500, 320, 240, {}}};

ObjectMeasurement at(const std::string& name, const SE3& T_camera_object) {
  ObjectMeasurement m;
  m.object = name;
  m.T_camera_object = T_camera_object;
  m.covariance = Matrix6d::Identity() * 1e-12;
  m.covariance(2, 2) = 9e-6;  // 3 mm along the plate's normal
  m.health = 1;
  m.claimed = true;
  return m;
}

SE3 ahead(double z_m, double tilt_rad = 0) {
  return {expSO3(Vector3d(tilt_rad, 0, 0)), Vector3d(0, 0, z_m)};
}

std::optional<InverseDepth> depthAt(const Vector2d& u_px,
                                    const std::vector<ObjectMeasurement>& objects, int level = 0) {
  VoOptions options;
  options.object_sigma_min_m = options.object_sigma_min_rad = 1e-9;
  const ObjectSurfaces surfaces(std::make_shared<Plates>(), {"plate", "wall"});
  return surfaces.depthAt(kCamera, u_px, level, objects, options);
}

TEST(ObjectSurfaces, TellsTheDepthAndHowWellItIsKnown) {
  const auto depth = depthAt({330, 250}, {at("plate", ahead(0.5))});
  ASSERT_TRUE(depth);
  EXPECT_NEAR(depth->value, 2, 1e-9);
  EXPECT_NEAR(depth->sigma, 0.003 * 4, 1e-4);  // d (1/z) = dz / z^2
}

TEST(ObjectSurfaces, ASlantedSurfaceIsKnownLessWellAlongTheRay) {
  const double tilt = 1;
  const auto depth = depthAt({320, 240}, {at("plate", ahead(0.5, tilt))});
  ASSERT_TRUE(depth);
  EXPECT_NEAR(depth->value, 2, 1e-9);
  EXPECT_NEAR(depth->sigma, 0.003 * 4 / std::cos(tilt), 1e-4);
  EXPECT_FALSE(depthAt({320, 240}, {at("plate", ahead(0.5, 1.5))})) << "seen edge-on";
}

TEST(ObjectSurfaces, SaysNothingBesideAnObjectNorAtItsOutline) {
  const std::vector<ObjectMeasurement> plate{at("plate", ahead(0.5))};  // 100 px to each side
  EXPECT_FALSE(depthAt({430, 240}, plate));
  EXPECT_FALSE(depthAt({417, 240}, plate));
  EXPECT_TRUE(depthAt({413, 240}, plate));
  EXPECT_FALSE(depthAt({413, 240}, plate, 2)) << "a coarse patch is larger";
  EXPECT_FALSE(depthAt({2, 240}, {at("wall", ahead(0.5))})) << "the image's border";
}

TEST(ObjectSurfaces, TheNearestObjectCounts) {
  const std::vector<ObjectMeasurement> both{at("wall", ahead(1)), at("plate", ahead(0.5))};
  ASSERT_TRUE(depthAt({320, 240}, both));
  EXPECT_NEAR(depthAt({320, 240}, both)->value, 2, 1e-9);
  EXPECT_NEAR(depthAt({500, 240}, both)->value, 1, 1e-9);
  EXPECT_FALSE(depthAt({419, 240}, both)) << "across the outline of the nearer one";
}

TEST(ObjectSurfaces, LeavesOutWhatIsNotKnownOrNotSeen) {
  ObjectMeasurement lost = at("plate", ahead(0.5)), wild = lost;
  lost.claimed = false;
  wild.T_camera_object.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(depthAt({320, 240}, {lost}));
  EXPECT_FALSE(depthAt({320, 240}, {wild}));
  EXPECT_FALSE(depthAt({320, 240}, {at("stranger", ahead(0.5))}));
  EXPECT_FALSE(depthAt({320, 240}, {at("plate", ahead(-0.5))})) << "behind the camera";
  EXPECT_FALSE(depthAt({320, 240}, {}));
  EXPECT_FALSE(ObjectSurfaces().depthAt(kCamera, {320, 240}, 0, {}, {}));
}

TEST(ObjectSurfaces, APatchTouchesWhatAnyOfItLiesOn) {
  const ObjectSurfaces surfaces(std::make_shared<Plates>(), {"plate", "wall"});
  const std::vector<ObjectMeasurement> plate{at("plate", ahead(0.5))};
  EXPECT_TRUE(surfaces.touch(kCamera, {320, 240}, 0, plate));
  // The plate ends at 420 px.
  EXPECT_TRUE(surfaces.touch(kCamera, {422, 240}, 0, plate));
  EXPECT_FALSE(surfaces.touch(kCamera, {430, 240}, 0, plate));
  EXPECT_TRUE(surfaces.touch(kCamera, {430, 240}, 2, plate));
  EXPECT_NEAR(surfaces.distanceTo(kCamera, {320, 240}, plate).value_or(0), 0.5, 1e-9);
  EXPECT_FALSE(surfaces.distanceTo(kCamera, {430, 240}, plate));
}

}  // namespace
}  // namespace diorama::vo
