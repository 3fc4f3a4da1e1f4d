#include "tracker/surface_look.h"

#include <gtest/gtest.h>

#include "tests/tracker/box_scene.h"
#include "tracker/edge_model.h"

namespace diorama {
namespace {

// Grey values of a thing that has nothing to do with the object.
void paint(Frame& frame, const Vector2d& low, const Vector2d& high, uint8_t grey) {
  for (int y = static_cast<int>(low.y()); y < static_cast<int>(high.y()); ++y)
    for (int x = static_cast<int>(low.x()); x < static_cast<int>(high.x()); ++x)
      frame.gray(x, y) = grey;
}

struct Look {
  test::BoxScene scene;
  TrackerOptions options;
  EdgeModel model = makeEdgeModel(scene.object().mesh, options);
  SurfaceLook surface{
      scene.object().mesh, model.centre_object, scene.camera, scene.rays, 0, options};
  SE3 T_camera_object = test::boxPose();
  SE3 T = T_camera_object * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  ProjectedBox box = projectedBox(model, scene.camera, T);

  Look() { learn(scene.draw(T_camera_object, 0)); }
  CoverMap compare(const Frame& frame) const { return surface.compare(surface.look(frame, T)); }
  void learn(const Frame& frame) { surface.learn(surface.look(frame, T), compare(frame)); }

  // Covered places of 100 that are spread over the projected box.
  int covered(const CoverMap& cover, double from_y, double to_y) const {
    int count = 0;
    for (int k = 0; k < 100; ++k) {
      const Vector2d share((k % 10 + 0.5) / 10, from_y + (to_y - from_y) * (k / 10 + 0.5) / 10);
      count += cover.isCovered(box.low + share.cwiseProduct(box.high - box.low));
    }
    return count;
  }
};

TEST(SurfaceLook, NothingLearnedNothingCovered) {
  Look look;
  const SurfaceLook fresh(look.scene.object().mesh, look.model.centre_object, look.scene.camera,
                          look.scene.rays, 0, look.options);
  Frame frame = look.scene.draw(look.T_camera_object, 1, true);
  EXPECT_EQ(look.covered(fresh.compare(fresh.look(frame, look.T)), 0, 1), 0);
  EXPECT_FALSE(CoverMap().isCovered({10, 10}));
  EXPECT_FALSE(CoverMap().any());
}

TEST(SurfaceLook, FindsWhatCoversTheObject) {
  Look look;
  Frame frame = look.scene.draw(look.T_camera_object, 1);
  const double middle = (look.box.low.y() + look.box.high.y()) / 2;
  paint(frame, look.box.low, {look.box.high.x(), middle}, 20);
  const CoverMap cover = look.compare(frame);
  EXPECT_TRUE(cover.any());
  EXPECT_GT(look.covered(cover, 0.1, 0.4), 70);  // the box fills its projected box but for corners
  EXPECT_EQ(look.covered(cover, 0.6, 1), 0);
}

// Neither a pose that is off by some pixels nor other light is a cover.
TEST(SurfaceLook, SmallErrorsAndOtherLightAreNoCover) {
  Look look;
  for (const Vector3d& off : {Vector3d(0.004, 0, 0), Vector3d(0, -0.004, 0.01)}) {
    const SE3 moved{look.T.rotation, look.T.translation + off};
    const CoverMap cover =
        look.surface.compare(look.surface.look(look.scene.draw(look.T_camera_object, 1), moved));
    EXPECT_LE(look.covered(cover, 0, 1), 8);
  }
  Frame darker = look.scene.draw(look.T_camera_object, 1);
  for (uint8_t& grey : darker.gray.pixels) grey = static_cast<uint8_t>(0.82 * grey);
  EXPECT_EQ(look.covered(look.compare(darker), 0, 1), 0);
}

// A hand that stays is not learned at once; a look that was wrong is given up in the end.
TEST(SurfaceLook, PatienceWithWhatChanged) {
  Look look;
  Frame covered = look.scene.draw(look.T_camera_object, 1);
  const double middle = (look.box.low.y() + look.box.high.y()) / 2;
  paint(covered, look.box.low, {look.box.high.x(), middle}, 20);
  for (int k = 0; k < look.options.surface_patience; ++k) look.learn(covered);
  EXPECT_GT(look.covered(look.compare(covered), 0.1, 0.4), 70);
  for (int k = 0; k < 5; ++k) look.learn(covered);
  EXPECT_EQ(look.covered(look.compare(covered), 0, 1), 0);
}

TEST(SurfaceLook, PosesThatSeeNothing) {
  Look look;
  const Frame frame = look.scene.draw(look.T_camera_object, 1);
  for (const Vector3d& t : {Vector3d(0, 0, -1), Vector3d(9, 0, 1), Vector3d(0, 0, 0)}) {
    const SE3 T{look.T.rotation, t};
    const auto sights = look.surface.look(frame, T);
    const CoverMap cover = look.surface.compare(sights);
    look.surface.learn(sights, cover);
    EXPECT_EQ(look.covered(cover, 0, 1), 0);
  }
  const SurfaceLook empty(Mesh{}, Vector3d::Zero(), look.scene.camera, look.scene.rays, 0,
                          look.options);
  EXPECT_EQ(look.covered(empty.compare(empty.look(frame, look.T)), 0, 1), 0);
}

}  // namespace
}  // namespace diorama
