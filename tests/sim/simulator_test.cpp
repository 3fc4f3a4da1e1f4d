#include "sim/simulator.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/errors.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

// A camera that drifts sideways past two squares, noisy and blurred.
Scene movingScene(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.path = makeSplinePath({{0, lookAt(Vector3d(0, 0.1, 0), Vector3d(1, 0.1, 0))},
                               {1, lookAt(Vector3d(0, -0.3, 0.1), Vector3d(1, 0, 0))}});
  scene.effects = {};
  scene.objects = {object("a", workshop.write("a.obj", square(0.3)), Vector3d(1, 0, 0)),
                   object("b", workshop.write("b.obj", square(0.1)), Vector3d(0.8, 0.1, 0), false)};
  return scene;
}

TEST(Simulator, FramesDependOnNothingButTheirNumber) {
  const Workshop workshop("frames");
  const Scene scene = movingScene(workshop);
  Simulator first(scene, {RenderQuality::kStandard, 1}),
      second(scene, {RenderQuality::kStandard, 2});
  first.read(3);
  const FrameAndTruth a = first.read(17), b = second.read(17);
  EXPECT_EQ(a.frame.rgb, b.frame.rgb);
  EXPECT_EQ(a.frame.gray, b.frame.gray);
  EXPECT_EQ(a.truth->depth_m, b.truth->depth_m);
  EXPECT_EQ(a.truth->instance_id, b.truth->instance_id);
  EXPECT_EQ(a.frame.timestamp_ns, scene.timestampNs(17));
  ASSERT_EQ(a.truth->objects.size(), 1u);  // only what is tracked
  EXPECT_EQ(a.truth->objects[0].name, "a");
  EXPECT_EQ(a.truth->objects[0].mask, b.truth->objects[0].mask);
  EXPECT_NE(first.read(18).frame.rgb, a.frame.rgb);
}

TEST(Simulator, MissingMeshIsReported) {
  Scene scene = plainScene();
  scene.objects = {object("none", "/nonexistent/none.obj", Vector3d(1, 0, 0))};
  EXPECT_THROW(Simulator{scene}, MissingInputError);
}

}  // namespace
}  // namespace diorama
