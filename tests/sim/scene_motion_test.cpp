// What a scene promises about its motion, measured from the truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "core/camera.h"
#include "sim/mesh_import.h"
#include "sim/scene.h"
#include "sim/simulator.h"

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

class OrangeJuice : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
    scene_ = new Scene(loadScene(DIORAMA_SOURCE_DIR "/scenes/orange_juice.yaml"));
    for (const SceneObject& object : scene_->objects)
      (object.tracked ? *tracked_ : *clutter_).push_back(boxOf(object));
    for (int k = 0; k < scene_->frameCount(); ++k) poses_->push_back(scene_->T_world_camera(k));
  }
  static inline Scene* scene_ = nullptr;
  static inline std::vector<Box>* tracked_ = new std::vector<Box>;
  static inline std::vector<Box>* clutter_ = new std::vector<Box>;
  static inline std::vector<SE3>* poses_ = new std::vector<SE3>;

  const Box& carton() const { return tracked_->front(); }
  // Pixels that the picture moves from one frame to the next, over a grid of room points.
  std::vector<double> imageMotion(size_t frame) const {
    const Camera camera(scene_->camera);
    const SE3 &now = (*poses_)[frame], &next = (*poses_)[frame + 1];
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
};

TEST_F(OrangeJuice, IsThirtySecondsOfVideo) {
  EXPECT_EQ(scene_->frameCount(), 900);
  EXPECT_EQ(scene_->rate_hz, 30);
  EXPECT_EQ(scene_->camera.width, 640);
  EXPECT_EQ(scene_->camera.height, 480);
  EXPECT_EQ(scene_->exposure_s, 0.008);
  EXPECT_TRUE(scene_->effects.blur);
  EXPECT_EQ(tracked_->size(), 1u);
  EXPECT_GE(clutter_->size(), 12u);
}

TEST_F(OrangeJuice, SweepsAroundTheCarton) {
  const Vector3d centre = carton().T_world_object * ((carton().min + carton().max) / 2);
  std::vector<double> azimuth, to_centre, to_origin;
  for (const SE3& pose : *poses_) {
    const Vector3d d = pose.translation - centre;
    azimuth.push_back(std::atan2(d.y(), d.x()));
    to_centre.push_back(d.norm());
    to_origin.push_back((pose.translation - carton().T_world_object.translation).norm());
  }
  const double sweep = (quantile(azimuth, 1) - quantile(azimuth, 0)) * kDegrees;
  RecordProperty("sweep_deg", std::to_string(sweep));
  EXPECT_GE(sweep, 120);
  EXPECT_LT(sweep, 180) << "the azimuth wraps";
  for (const auto& distance : {to_centre, to_origin}) {
    RecordProperty("distance_m", std::to_string(quantile(distance, 0)) + " to " +
                                     std::to_string(quantile(distance, 1)));
    EXPECT_GE(quantile(distance, 0), 0.4);
    EXPECT_LE(quantile(distance, 1), 1.2);
  }
  EXPECT_LT(quantile(to_centre, 0), 0.5);
  EXPECT_GT(quantile(to_centre, 1), 1.0);
}

TEST_F(OrangeJuice, MovesLikeAHand) {
  std::vector<double> speed, turn;
  for (size_t k = 0; k + 1 < poses_->size(); ++k) {
    const SE3 &a = (*poses_)[k], &b = (*poses_)[k + 1];
    speed.push_back((b.translation - a.translation).norm() * scene_->rate_hz);
    turn.push_back(angleBetween(a.rotation, b.rotation) * scene_->rate_hz * kDegrees);
  }
  std::printf(
      "speed: mean %.3f, 95%% %.3f, max %.3f m/s; turn: mean %.1f, 95%% %.1f, max %.1f deg/s\n",
      mean(speed), quantile(speed, 0.95), quantile(speed, 1), mean(turn), quantile(turn, 0.95),
      quantile(turn, 1));
  EXPECT_GE(mean(speed), 0.25);
  EXPECT_GE(quantile(speed, 0.95), 0.6);
  EXPECT_LE(quantile(speed, 1), 2.0);
  EXPECT_GE(quantile(turn, 0.95), 60);
  EXPECT_LE(quantile(turn, 1), 200);
}

TEST_F(OrangeJuice, MovesThePicture) {
  const Camera camera(scene_->camera);
  std::vector<double> all, of_carton;
  for (size_t k = 0; k + 1 < poses_->size(); ++k) {
    const std::vector<double> motion = imageMotion(k);
    all.insert(all.end(), motion.begin(), motion.end());
    for (const Vector3d& corner : carton().corners()) {
      const auto a = camera.project((*poses_)[k].inverse() * corner);
      const auto b = camera.project((*poses_)[k + 1].inverse() * corner);
      if (a && b) of_carton.push_back((*a - *b).norm());
    }
  }
  std::printf("image motion: median %.2f px, of the carton %.2f px, 95%% %.2f and %.2f px\n",
              quantile(all, 0.5), quantile(of_carton, 0.5), quantile(all, 0.95),
              quantile(of_carton, 0.95));
  EXPECT_GE(quantile(all, 0.5), 4);
  EXPECT_GE(quantile(of_carton, 0.5), 4);
}

TEST_F(OrangeJuice, KeepsTheCartonInView) {
  const Camera camera(scene_->camera);
  double least_margin = 1e9;
  std::vector<double> x, y;
  for (size_t k = 0; k < poses_->size(); ++k) {
    for (const Vector3d& corner : carton().corners()) {
      const auto u = camera.project((*poses_)[k].inverse() * corner);
      ASSERT_TRUE(u.has_value()) << "frame " << k;
      const double margin = std::min({u->x(), u->y(), 639 - u->x(), 479 - u->y()});
      least_margin = std::min(least_margin, margin);
      EXPECT_GE(margin, 6) << "frame " << k;
    }
    const Vector3d centre = carton().T_world_object * ((carton().min + carton().max) / 2);
    const auto u = camera.project((*poses_)[k].inverse() * centre);
    x.push_back(u->x());
    y.push_back(u->y());
  }
  std::printf("margin %.1f px; the carton's centre moves from %.0f to %.0f and %.0f to %.0f px\n",
              least_margin, quantile(x, 0), quantile(x, 1), quantile(y, 0), quantile(y, 1));
  EXPECT_GT(quantile(x, 0.95) - quantile(x, 0.05), 100) << "not merely centred";
}

TEST_F(OrangeJuice, StaysOutOfThingsAndSeesTheCarton) {
  double least_distance = 1e9;
  for (size_t k = 0; k < poses_->size(); ++k) {
    const Vector3d p = (*poses_)[k].translation;
    if (std::abs(p.x()) < 0.85 && std::abs(p.y()) < 0.45) {
      EXPECT_GE(p.z(), 0.12) << "frame " << k;
    }
    EXPECT_GT(p.z(), 0) << "frame " << k;
    const Box& o = carton();
    for (const Box& box : *clutter_) {
      least_distance = std::min(least_distance, box.distance(p));
      EXPECT_GT(box.distance(p), 0.05) << box.name << ", frame " << k;
      // Points on the carton's axis and sides, seen past every other thing's box.
      for (double height : {0.1, 0.5, 0.95})
        for (double side : {0.1, 0.5, 0.9}) {
          const Vector3d point =
              o.T_world_object *
              Vector3d(o.min.x() * (1 - side) + o.max.x() * side, 0, o.max.z() * height);
          EXPECT_FALSE(box.cuts(p, point)) << box.name << ", frame " << k << ", " << height;
        }
    }
  }
  std::printf("nearest thing: %.3f m\n", least_distance);
}

TEST_F(OrangeJuice, ThingsDoNotOverlap) {
  std::vector<Box> boxes = *clutter_;
  boxes.push_back(carton());
  for (const Box& box : boxes)
    for (const Vector3d& corner : box.corners()) {
      EXPECT_LE(std::abs(corner.x()), 0.85) << box.name;
      EXPECT_LE(std::abs(corner.y()), 0.45) << box.name;
    }
  for (const Box& other : *clutter_)
    EXPECT_GT(other.distance(carton().T_world_object * Vector3d(0, 0, 0.05)), 0.06) << other.name;
}

TEST_F(OrangeJuice, LensBendsTheCorners) {
  CameraParameters straight = scene_->camera;
  straight.distortion.clear();
  const Camera bent(scene_->camera), pinhole(straight);
  double largest = 0;
  for (double x : {0.0, 639.0})
    for (double y : {0.0, 479.0}) {
      const auto ray = bent.unproject({x, y});
      ASSERT_TRUE(ray.has_value());
      largest = std::max(largest, (*pinhole.project(*ray) - Vector2d(x, y)).norm());
    }
  std::printf("distortion: %.1f px in a corner\n", largest);
  EXPECT_EQ(scene_->camera.model, CameraModel::kRadTan);
  EXPECT_GE(largest, 8);
}

// The same frame with two seeds differs by nothing but the noise.
TEST_F(OrangeJuice, SensorIsNoisy) {
  std::vector<Image<uint8_t>> pictures;
  for (uint64_t seed : {1u, 2u}) {
    Scene scene = *scene_;
    scene.seed = seed;
    pictures.push_back(Simulator(scene, {RenderQuality::kDraft}).read(0).frame.gray);
  }
  double sum = 0;
  int count = 0;
  for (size_t i = 0; i < pictures[0].pixels.size(); ++i) {
    const double a = pictures[0].pixels[i], b = pictures[1].pixels[i];
    if (std::abs((a + b) / 2 - 127.5) > 10) continue;
    sum += (a - b) * (a - b) / 2;
    ++count;
  }
  ASSERT_GT(count, 1000);
  const double levels = std::sqrt(sum / count);
  std::printf("noise: %.2f grey levels at mid-grey\n", levels);
  EXPECT_GE(levels, 2);
  EXPECT_LE(levels, 4);
}

}  // namespace
}  // namespace diorama
