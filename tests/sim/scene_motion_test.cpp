// What the scenes promise about their motion, measured from the truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "core/camera.h"
#include "sim/mesh_import.h"
#include "sim/scene.h"

namespace diorama {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
}
double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

// An object's bounding box in its own frame.
struct Box {
  SE3 T_world_object;
  Vector3d min, max;
  std::string name;

  std::vector<Vector3d> corners() const {
    std::vector<Vector3d> corners;
    for (int i = 0; i < 8; ++i)
      corners.push_back(T_world_object * Vector3d((i & 1 ? max : min).x(), (i & 2 ? max : min).y(),
                                                  (i & 4 ? max : min).z()));
    return corners;
  }
  double distance(const Vector3d& p_world) const {
    const Vector3d p = T_world_object.inverse() * p_world;
    return (p - p.cwiseMax(min).cwiseMin(max)).norm();
  }
  // Whether the straight line between two points passes through the box (slab test).
  bool cuts(const Vector3d& from_world, const Vector3d& to_world) const {
    const Vector3d a = T_world_object.inverse() * from_world,
                   b = T_world_object.inverse() * to_world;
    double enter = 0, leave = 1;
    for (int k = 0; k < 3; ++k) {
      const double d = b[k] - a[k];
      if (std::abs(d) < 1e-12) {
        if (a[k] < min[k] || a[k] > max[k]) return false;
        continue;
      }
      const double s = (min[k] - a[k]) / d, t = (max[k] - a[k]) / d;
      enter = std::max(enter, std::min(s, t));
      leave = std::min(leave, std::max(s, t));
    }
    return enter < leave;
  }
};

Box boxOf(const SceneObject& object) {
  const Mesh mesh = importMesh(object.mesh, {object.scale, object.y_up});
  return {object.T_world_object, mesh.minCorner().cast<double>(), mesh.maxCorner().cast<double>(),
          object.name};
}

// Where a ray from inside the room meets the desk top, the floor or a wall.
Vector3d roomPoint(const Vector3d& origin, const Vector3d& direction) {
  const Vector3d low(-2.5, -2.3, -0.74), high(2.5, 2.3, 1.86);
  double t = 1e9;
  for (int k = 0; k < 3; ++k)
    if (std::abs(direction[k]) > 1e-9)
      t = std::min(t, ((direction[k] > 0 ? high : low)[k] - origin[k]) / direction[k]);
  if (direction.z() < 0) {
    const Vector3d p = origin + direction * (-origin.z() / direction.z());
    if (std::abs(p.x()) < 0.8 && std::abs(p.y()) < 0.4) t = -origin.z() / direction.z();
  }
  return origin + t * direction;
}

// A scene of scenes/ with its boxes and the poses of its frames; occluders are left out, as their
// ways are solved for in scene_occlusion_e2e_test.cpp.
struct Filmed {
  explicit Filmed(const std::string& name) : scene(load(name)) {
    for (const SceneObject& object : scene.objects)
      (object.tracked ? tracked : clutter).push_back(boxOf(object));
    for (int k = 0; k < scene.frameCount(); ++k) poses.push_back(scene.T_world_camera(k));
  }
  static Scene load(const std::string& name) {
    ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
    return loadScene(std::string(DIORAMA_SOURCE_DIR "/scenes/") + name + ".yaml",
                     {parseOverride("occlude=[]")});
  }
  const Box& first() const { return tracked.front(); }
  Vector3d centre() const { return first().T_world_object * ((first().min + first().max) / 2); }

  // Pixels that the picture moves from one frame to the next, over a grid of room points.
  std::vector<double> imageMotion(size_t frame) const {
    const Camera camera(scene.camera);
    const SE3 &now = poses[frame], &next = poses[frame + 1];
    std::vector<double> motion;
    for (int y = 20; y < 480; y += 40)
      for (int x = 20; x < 640; x += 40) {
        const Vector2d u(x, y);
        const auto ray = camera.unproject(u);
        if (!ray) continue;
        const Vector3d p = roomPoint(now.translation, now.rotation * *ray);
        if (const auto moved = camera.project(next.inverse() * p))
          motion.push_back((*moved - u).norm());
      }
    return motion;
  }
  std::vector<double> imageMotion() const {
    std::vector<double> all;
    for (size_t k = 0; k + 1 < poses.size(); ++k) {
      const std::vector<double> motion = imageMotion(k);
      all.insert(all.end(), motion.begin(), motion.end());
    }
    return all;
  }
  std::vector<double> speeds_m_s() const {
    std::vector<double> speed;
    for (size_t k = 0; k + 1 < poses.size(); ++k)
      speed.push_back((poses[k + 1].translation - poses[k].translation).norm() * scene.rate_hz);
    return speed;
  }
  std::vector<double> turns_deg_s() const {
    std::vector<double> turn;
    for (size_t k = 0; k + 1 < poses.size(); ++k)
      turn.push_back(angleBetween(poses[k].rotation, poses[k + 1].rotation) * scene.rate_hz *
                     kDegrees);
    return turn;
  }
  // How far inside the image the first object's box is, px; below 0: a corner is outside.
  double margin(size_t frame) const {
    const Camera camera(scene.camera);
    double least = 1e9;
    for (const Vector3d& corner : first().corners()) {
      const auto u = camera.project(poses[frame].inverse() * corner);
      if (!u) return -1e9;
      least = std::min({least, u->x(), u->y(), 639 - u->x(), 479 - u->y()});
    }
    return least;
  }
  // No corner of the first object's box is in the image.
  bool isAway(size_t frame) const {
    const Camera camera(scene.camera);
    for (const Vector3d& corner : first().corners()) {
      const auto u = camera.project(poses[frame].inverse() * corner);
      if (u && camera.contains(*u)) return false;
    }
    return true;
  }

  Scene scene;
  std::vector<Box> tracked, clutter;
  std::vector<SE3> poses;
};

// The scenes that a hand films around a cluttered desk.
class DeskScene : public ::testing::TestWithParam<const char*> {
 protected:
  const Filmed film_{GetParam()};
  void checkIsThirtySecondsOfNoisyBlurredVideo() const;
  void checkSweepsAroundTheObject() const;
  void checkMovesLikeAHand() const;
  void checkMovesThePicture() const;
  void checkKeepsTheObjectInViewOrLooksAwayForThreeSeconds() const;
  void checkStaysOutOfThingsAndSeesTheObject() const;
  void checkThingsStandOnTheDesk() const;
  void checkLensBendsTheCorners() const;
  bool looksAway() const { return std::string(GetParam()).find("occluded") != std::string::npos; }
};
INSTANTIATE_TEST_SUITE_P(Scenes, DeskScene,
                         ::testing::Values("orange_juice", "orange_juice_occluded", "pasta_box",
                                           "pasta_box_occluded", "detergent", "detergent_occluded",
                                           "multi_object"),
                         [](const auto& info) { return std::string(info.param); });

void DeskScene::checkIsThirtySecondsOfNoisyBlurredVideo() const {
  const Scene& scene = film_.scene;
  EXPECT_EQ(scene.frameCount(), 900);
  EXPECT_EQ(scene.rate_hz, 30);
  EXPECT_EQ(scene.camera.width, 640);
  EXPECT_EQ(scene.camera.height, 480);
  EXPECT_EQ(scene.exposure_s, 0.008);
  EXPECT_TRUE(scene.effects.blur);
  // What the noise of scene_noise_e2e_test.cpp follows from.
  EXPECT_TRUE(scene.effects.noise);
  EXPECT_LE(scene.effects.full_well_e, 9000);
  EXPECT_EQ(film_.tracked.size(), std::string(GetParam()) == "multi_object" ? 3u : 1u);
  EXPECT_GE(film_.clutter.size(), 12u);
}

void DeskScene::checkSweepsAroundTheObject() const {
  std::vector<double> azimuth, to_centre, to_origin;
  for (const SE3& pose : film_.poses) {
    const Vector3d d = pose.translation - film_.centre();
    azimuth.push_back(std::atan2(d.y(), d.x()));
    to_centre.push_back(d.norm());
    to_origin.push_back((pose.translation - film_.first().T_world_object.translation).norm());
  }
  const double sweep = (quantile(azimuth, 1) - quantile(azimuth, 0)) * kDegrees;
  EXPECT_GE(sweep, 120);
  EXPECT_LT(sweep, 180) << "the azimuth wraps";
  for (const auto& distance : {to_centre, to_origin}) {
    EXPECT_GE(quantile(distance, 0), 0.4);
    EXPECT_LE(quantile(distance, 1), 1.2);
  }
  EXPECT_GT(quantile(to_centre, 1) - quantile(to_centre, 0), 0.3);
}

void DeskScene::checkMovesLikeAHand() const {
  const std::vector<double> speed = film_.speeds_m_s(), turn = film_.turns_deg_s();
  std::printf(
      "speed: mean %.3f, 95%% %.3f, max %.3f m/s; turn: mean %.1f, 95%% %.1f, max %.1f deg/s\n",
      mean(speed), quantile(speed, 0.95), quantile(speed, 1), mean(turn), quantile(turn, 0.95),
      quantile(turn, 1));
  EXPECT_GE(mean(speed), 0.25);
  EXPECT_GE(quantile(speed, 0.95), 0.6);
  EXPECT_LE(quantile(speed, 1), 2.0);
  EXPECT_GE(quantile(turn, 0.95), 60);
  EXPECT_LE(quantile(turn, 1), looksAway() ? 300 : 200);
}

void DeskScene::checkMovesThePicture() const {
  const Camera camera(film_.scene.camera);
  const std::vector<double> all = film_.imageMotion();
  std::vector<double> of_object;
  for (size_t k = 0; k + 1 < film_.poses.size(); ++k)
    for (const Vector3d& corner : film_.first().corners()) {
      const auto a = camera.project(film_.poses[k].inverse() * corner);
      const auto b = camera.project(film_.poses[k + 1].inverse() * corner);
      if (a && b) of_object.push_back((*a - *b).norm());
    }
  std::printf("image motion: median %.2f px, of the object %.2f px, 95%% %.2f and %.2f px\n",
              quantile(all, 0.5), quantile(of_object, 0.5), quantile(all, 0.95),
              quantile(of_object, 0.95));
  EXPECT_GE(quantile(all, 0.5), 4);
  EXPECT_GE(quantile(of_object, 0.5), 2.5);
}

void DeskScene::checkKeepsTheObjectInViewOrLooksAwayForThreeSeconds() const {
  const Camera camera(film_.scene.camera);
  std::vector<double> x;
  double least_margin = 1e9;
  int away = 0;
  size_t last_away = 0;
  for (size_t k = 0; k < film_.poses.size(); ++k)
    if (film_.isAway(k)) ++away, last_away = k;
  for (size_t k = 0; k < film_.poses.size(); ++k) {
    // Turning away and back takes a second each.
    const bool turning =
        away > 0 && k + static_cast<size_t>(away) + 30 > last_away && k < last_away + 30;
    if (!turning) least_margin = std::min(least_margin, film_.margin(k));
    if (const auto u = camera.project(film_.poses[k].inverse() * film_.centre()); u && !turning)
      x.push_back(u->x());
  }
  std::printf("margin %.1f px, away for %d frames\n", least_margin, away);
  EXPECT_GE(least_margin, 1);
  EXPECT_GT(quantile(x, 0.95) - quantile(x, 0.05), 60) << "not merely centred";
  if (!looksAway()) {
    EXPECT_EQ(away, 0);
    return;
  }
  EXPECT_GE(away, 90);
  EXPECT_LE(away, 120);
  EXPECT_LT(last_away + 60, film_.poses.size()) << "it comes back";
}

void DeskScene::checkStaysOutOfThingsAndSeesTheObject() const {
  double least_distance = 1e9;
  int hidden = 0;
  for (size_t k = 0; k < film_.poses.size(); ++k) {
    const Vector3d p = film_.poses[k].translation;
    if (std::abs(p.x()) < 0.85 && std::abs(p.y()) < 0.45) {
      EXPECT_GE(p.z(), 0.12) << "frame " << k;
    }
    EXPECT_GT(p.z(), 0) << "frame " << k;
    const Box& o = film_.first();
    for (const Box& box : film_.clutter) {
      least_distance = std::min(least_distance, box.distance(p));
      EXPECT_GT(box.distance(p), 0.05) << box.name << ", frame " << k;
      // Points on the object's axis and sides, seen past every other thing's box.
      for (double height : {0.1, 0.5, 0.95})
        for (double side : {0.1, 0.5, 0.9}) {
          const Vector3d point =
              o.T_world_object *
              Vector3d(o.min.x() * (1 - side) + o.max.x() * side, 0, o.max.z() * height);
          if (box.cuts(p, point)) ++hidden;
        }
    }
  }
  std::printf("nearest thing: %.3f m; %d sight lines cut\n", least_distance, hidden);
  EXPECT_LE(hidden, std::string(GetParam()) == "multi_object" ? 400 : 0);
}

void DeskScene::checkThingsStandOnTheDesk() const {
  std::vector<Box> boxes = film_.clutter;
  boxes.insert(boxes.end(), film_.tracked.begin(), film_.tracked.end());
  for (const Box& box : boxes)
    for (const Vector3d& corner : box.corners()) {
      EXPECT_LE(std::abs(corner.x()), 0.88) << box.name;
      EXPECT_LE(std::abs(corner.y()), 0.46) << box.name;
    }
  for (const Box& other : film_.clutter)
    EXPECT_GT(other.distance(film_.first().T_world_object * Vector3d(0, 0, 0.05)), 0.06)
        << other.name;
}

void DeskScene::checkLensBendsTheCorners() const {
  CameraParameters straight = film_.scene.camera;
  straight.distortion.clear();
  const Camera bent(film_.scene.camera), pinhole(straight);
  double largest = 0;
  for (double x : {0.0, 639.0})
    for (double y : {0.0, 479.0}) {
      const auto ray = bent.unproject({x, y});
      ASSERT_TRUE(ray.has_value());
      largest = std::max(largest, (*pinhole.project(*ray) - Vector2d(x, y)).norm());
    }
  EXPECT_EQ(film_.scene.camera.model, CameraModel::kRadTan);
  EXPECT_GE(largest, 8);
}

// One test a scene: reading it takes a second or two.
TEST_P(DeskScene, KeepsItsPromises) {
  checkIsThirtySecondsOfNoisyBlurredVideo();
  checkSweepsAroundTheObject();
  checkMovesLikeAHand();
  checkMovesThePicture();
  checkKeepsTheObjectInViewOrLooksAwayForThreeSeconds();
  checkStaysOutOfThingsAndSeesTheObject();
  checkThingsStandOnTheDesk();
  checkLensBendsTheCorners();
}

// The scenes under scenes/stress, each for what it is hard.
TEST(StressScene, FastMotionMovesThePictureByThirtyPixels) {
  EXPECT_GE(quantile(Filmed("stress/fast_motion").imageMotion(), 0.5), 30);
}

TEST(StressScene, RotationOnlyTurnsOnTheSpot) {
  const Filmed f("stress/rotation_only");
  EXPECT_EQ(f.scene.duration_s, 20);
  double widest = 0;
  for (const SE3& pose : f.poses) {
    EXPECT_LT((pose.translation - f.poses[0].translation).norm(), 1e-9);
    widest = std::max(widest, angleBetween(pose.rotation, f.poses[0].rotation));
  }
  EXPECT_GT(widest * kDegrees, 15);
  EXPECT_GE(quantile(f.imageMotion(), 0.5), 3);
}

TEST(StressScene, MotionBlurDrawsPointsOutOverPixels) {
  const Filmed f("stress/motion_blur");
  EXPECT_EQ(f.scene.exposure_s, 0.020);
  EXPECT_TRUE(f.scene.effects.blur);
  EXPECT_GE(quantile(f.imageMotion(), 0.5) * f.scene.exposure_s * f.scene.rate_hz, 3);
}

TEST(StressScene, HandheldLastsTwoMinutes) {
  const Filmed f("stress/handheld");
  EXPECT_EQ(f.scene.frameCount(), 3600);
  EXPECT_GE(mean(f.speeds_m_s()), 0.25);
}

TEST(StressScene, MovingObjectSlidesOnTheDeskAndRests) {
  const Filmed f("stress/moving_object");
  const SceneObject& object = f.scene.objects[0];
  ASSERT_TRUE(object.tracked && object.path);
  double way = 0;
  int resting = 0;
  for (int k = 0; k + 1 < f.scene.frameCount(); ++k) {
    const SE3 a = object.pose(f.scene.time_s(k)), b = object.pose(f.scene.time_s(k + 1));
    EXPECT_NEAR(a.translation.z(), 0, 1e-9);
    way += (b.translation - a.translation).norm();
    resting += (b.translation - a.translation).norm() < 1e-6 ? 1 : 0;
  }
  EXPECT_GT(way, 0.5);
  EXPECT_GT(resting, 30);
}

TEST(StressScene, FigurineFitsIntoAPalm) {
  const Filmed f("stress/figurine");
  const Box& bird = f.first();
  EXPECT_LT((bird.max - bird.min).maxCoeff(), 0.12);
}

TEST(StressScene, LowLightHasFewElectrons) {
  const Filmed f("stress/low_light");
  const Scene& scene = f.scene;
  EXPECT_TRUE(scene.effects.noise);
  EXPECT_LE(scene.effects.full_well_e, 1000);
}

TEST(StressScene, RollingShutterTakesMostOfAFrame) {
  const Filmed f("stress/rolling_shutter");
  EXPECT_GT(f.scene.row_time_s * f.scene.camera.height * f.scene.rate_hz, 0.5);
}

TEST(StressScene, LightingChangesAndTheExposureFollows) {
  const Filmed f("stress/lighting_change");
  EXPECT_FALSE(f.scene.effects.lighting.constant());
  EXPECT_EQ(f.scene.effects.exposure, "auto");
}

TEST(StressScene, LowTextureIsABareRoom) {
  const Filmed f("stress/low_texture");
  EXPECT_LE(f.clutter.size(), 3u);
  EXPECT_NE(f.scene.environment_mesh.string().find("plain_room"), std::string::npos);
}

}  // namespace
}  // namespace diorama
