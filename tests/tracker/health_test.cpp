#include "tracker/health.h"

#include <gtest/gtest.h>

#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

EdgeObservation observation(std::vector<EdgeCandidate> candidates, bool contour = true) {
  EdgeObservation o;
  o.contour = contour;
  o.candidate_count = static_cast<int>(candidates.size());
  for (size_t k = 0; k < candidates.size(); ++k) o.candidates[k] = candidates[k];
  return o;
}

EdgeCandidate edge(double offset_px, float strength, bool like_before = true) {
  return {offset_px, {strength, 0, 0}, like_before};
}

double healthOf(const VisibleSamples& visible, const std::vector<EdgeObservation>& observations) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const TextureCue none(model, scene.camera, scene.rays, 0, options, 1);
  return assessHealth(visible, observations, none, none, options).value;
}

TEST(Health, IsTheShareOfSamplesWithAnEdge) {
  std::vector<EdgeObservation> half(50, observation({edge(0.2, 30)}));
  EXPECT_DOUBLE_EQ(healthOf({100, 0}, half), 0.5);
  EXPECT_DOUBLE_EQ(healthOf({50, 0}, half), 1);
  EXPECT_DOUBLE_EQ(healthOf({50, 0}, {}), 0);
}

TEST(Health, EdgesAnywhereAreChance) {
  const std::vector<EdgeObservation> clutter(50,
                                             observation({edge(0, 20), edge(5, 20), edge(-5, 20)}));
  EXPECT_DOUBLE_EQ(healthOf({50, 0}, clutter), 0);
}

TEST(Health, WeakEdgesBesideAStrongOneAreNoChance) {
  const std::vector<EdgeObservation> outline(50,
                                             observation({edge(0, 40), edge(5, 8), edge(-5, 8)}));
  EXPECT_DOUBLE_EQ(healthOf({50, 0}, outline), 1);
}

TEST(Health, MissingCreasesWeighLessThanMissingOutlines) {
  const std::vector<EdgeObservation> outline(60, observation({edge(0, 30)}));
  const std::vector<EdgeObservation> creases(60, observation({edge(0, 30)}, false));
  EXPECT_GT(healthOf({60, 40}, outline), 0.7);
  EXPECT_LT(healthOf({40, 60}, creases), 0.45);
}

TEST(Health, UnfamiliarEdgesDoNotCount) {
  const std::vector<EdgeObservation> strange(50, observation({edge(0, 30, false)}));
  EXPECT_DOUBLE_EQ(healthOf({50, 0}, strange), 0);
}

TEST(Health, TooFewSamplesSayNothing) {
  const std::vector<EdgeObservation> few(5, observation({edge(0, 30)}));
  EXPECT_DOUBLE_EQ(healthOf({5, 0}, few), 0);
}

}  // namespace
}  // namespace diorama
