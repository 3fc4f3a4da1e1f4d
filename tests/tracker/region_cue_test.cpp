// Colours beside an outline: where they change, and which edges they doubt.
#include "tracker/region_cue.h"

#include <gtest/gtest.h>

#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

constexpr Rgb8 kObject{120, 160, 140}, kWood{190, 150, 100}, kShadow{60, 45, 30}, kNew{200, 60, 60};

// Columns up to the outline show the object, those behind it wood, with a dark stripe.
Frame stripes(int outline_x, int shadow_from, int shadow_to, Rgb8 object = kObject) {
  Frame frame;
  frame.rgb = Image<Rgb8>(64, 64);
  frame.gray = Image<uint8_t>(64, 64);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      frame.rgb(x, y) = x <= outline_x                      ? object
                        : x >= shadow_from && x < shadow_to ? kShadow
                                                            : kWood;
  return frame;
}

std::vector<SampleSides> verticalOutline(double x) {
  std::vector<SampleSides> outline;
  for (int i = 0; i < 20; ++i)
    outline.push_back({i, Vector2d(x, 12 + 2 * i), Vector2d(1, 0), true, 8, 8});
  return outline;
}

OutlineColors learned() {
  OutlineColors colors;
  colors.learn(stripes(31, 40, 42), verticalOutline(31.5), 0.2f, 0.2f);
  return colors;
}

TEST(OutlineColors, FindTheOutlineBesideAStrongerEdge) {
  const OutlineColors colors = learned();
  ASSERT_TRUE(colors.known());
  for (const int shift : {-4, -1, 0, 3}) {
    const Frame frame = stripes(31 + shift, 34 + shift, 36 + shift);
    const OutlineLikelihood likelihood = colors.compare(frame, verticalOutline(31.5)[3]);
    EXPECT_NEAR(likelihood.mean_px, shift, 0.7);  // pixels are not read between their centres
    EXPECT_GT(likelihood.information, 0.5);

    EdgeObservation edge;
    edge.u_px = {31.5, 18};
    edge.normal = Vector2d(-1, 0);  // its sign says nothing
    edge.candidate_count = 2;
    edge.candidates[0].offset_px = -shift;
    edge.candidates[1].offset_px = -(shift + 4);  // the end of the shadow
    likelihood.doubt(3, edge);
    EXPECT_TRUE(edge.candidates[0].like_before) << shift;
    EXPECT_FALSE(edge.candidates[1].like_before) << shift;
  }
}

TEST(OutlineColors, TellNothingWhereBothSidesAreAlike) {
  OutlineColors colors;
  colors.learn(stripes(31, 40, 40, kWood), verticalOutline(31.5), 0.2f, 0.2f);
  const OutlineLikelihood likelihood =
      colors.compare(stripes(25, 40, 40, kWood), verticalOutline(31.5)[0]);
  EXPECT_EQ(likelihood.information, 0);
}

TEST(OutlineColors, KnowWhatIsNew) {
  const OutlineColors colors = learned();
  SampleSides sample = verticalOutline(31.5)[0];
  EXPECT_TRUE(colors.isFamiliar(stripes(31, 40, 42), sample));
  EXPECT_FALSE(colors.isFamiliar(stripes(31, 40, 42, kNew), sample));
  sample.outline = false;  // then the other side must be the object, too
  EXPECT_FALSE(colors.isFamiliar(stripes(31, 40, 42), sample));
  EXPECT_TRUE(colors.isFamiliar(stripes(45, 50, 52), sample));
}

TEST(OutlineColors, NothingIsLearnedInsideWhereSomethingCovers) {
  OutlineColors colors = learned();
  for (int i = 0; i < 50; ++i)
    colors.learn(stripes(31, 40, 42, kNew), verticalOutline(31.5), 0, 0.2f);
  EXPECT_FALSE(colors.isFamiliar(stripes(31, 40, 42, kNew), verticalOutline(31.5)[0]));
  EXPECT_TRUE(colors.isFamiliar(stripes(31, 40, 42), verticalOutline(31.5)[0]));
}

TEST(OutlineColors, AFewPixelsAreNotLearned) {
  OutlineColors colors;
  colors.learn(stripes(31, 40, 42), {verticalOutline(31.5)[0]}, 0.2f, 0.2f);
  EXPECT_FALSE(colors.known());
}

struct BoxOutline : testing::Test {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(scene.box), options);
  const EdgeSearch search{model, scene.camera, scene.rays, 0, options};
  const SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
};

// Of a box, all that is not inside its silhouette is outwards.
TEST_F(BoxOutline, TellsTheObjectsSide) {
  const std::vector<int> samples = search.visibleSamples(T);
  const Vector2d middle = *scene.camera.project(T.translation);
  const auto outline = search.sidesOf(T, samples, 3, 8, true);
  const auto all = search.sidesOf(T, samples, 3, 8, false);
  EXPECT_GT(outline.size(), 20u);
  EXPECT_GT(all.size(), outline.size() + 5);  // creases inside
  for (const SampleSides& s : outline) {
    EXPECT_TRUE(s.outline);
    EXPECT_GT(s.outwards.dot(s.u_px - middle), 0);
  }
}

// The colours alone pull a displaced pose back.
TEST_F(BoxOutline, PullsAPoseByItsColours) {
  Frame frame = scene.draw(test::boxPose(), 0);
  frame.rgb = Image<Rgb8>(frame.gray.width, frame.gray.height);
  const Vector3d eye = test::boxPose().inverse().translation;
  const Matrix3d R = test::boxPose().rotationMatrix().transpose();
  for (int y = 0; y < frame.gray.height; ++y)
    for (int x = 0; x < frame.gray.width; ++x) {
      const auto ray = scene.camera.unproject({x, y});
      frame.rgb(x, y) = ray && scene.rays.closestHit(0, eye, R * *ray) ? kObject : kWood;
    }
  const auto outlineAt = [&](const SE3& pose) {
    return search.sidesOf(pose, search.visibleSamples(pose), 3, 8, true);
  };
  OutlineColors colors;
  colors.learn(frame, outlineAt(T), 0.2f, 0.2f);
  const SE3 displaced = T * exp((Vector6d() << 0.004, -0.003, 0.002, 0.01, 0, 0.01).finished());
  SE3 found = displaced;
  for (int round = 0; round < 3; ++round) {
    std::vector<OutlineLikelihood> outline;
    for (const SampleSides& s : outlineAt(found)) outline.push_back(colors.compare(frame, s));
    RegionCue region(model, scene.camera, options, outline);
    Cue* const cues[] = {&region};
    found = solvePose(found, cues, {}).T_camera_model;
  }
  const auto pixels = [&](const SE3& a) {
    return (*scene.camera.project(a.translation) - *scene.camera.project(T.translation)).norm();
  };
  EXPECT_GT(pixels(displaced), 2);
  EXPECT_LT(pixels(found), 0.3);
}

}  // namespace
}  // namespace diorama
