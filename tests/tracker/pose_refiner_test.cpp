// What a pose's neighbours say of it.
#include "tracker/pose_refiner.h"

#include <gtest/gtest.h>

#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

// A picture in which the object stands in two places, 5 px apart.
TEST(PoseRefinerTest, PosesThatExplainTheImageAlikeAddToTheCovariance) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const Mesh mesh = test::boxMesh(scene.box);
  const EdgeModel model = makeEdgeModel(mesh, options);
  const SE3 shift{Eigen::Quaterniond::Identity(), Vector3d(0.007, 0, 0)};
  const Frame one = scene.draw(test::boxPose(), 0), other = scene.draw(shift * test::boxPose(), 0);
  Frame both = one;
  for (size_t i = 0; i < both.gray.pixels.size(); ++i)
    both.gray.pixels[i] = static_cast<uint8_t>((one.gray.pixels[i] + other.gray.pixels[i]) / 2);

  const auto sigma = [&](const Frame& frame, bool with_neighbours) {
    PoseRefiner refiner(model, mesh, scene.camera, scene.rays, 0, options);
    refiner.setImage(frame, Covers::kIgnored);
    Estimate estimate =
        refiner.refine(test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object});
    if (with_neighbours) estimate = refiner.searchNeighbours(std::move(estimate));
    return std::sqrt(estimate.covariance.topLeftCorner<3, 3>().trace());
  };
  const double distance = shift.translation.norm();
  std::printf("sigma over the distance: one place %.2f, %.2f with neighbours; two %.2f, %.2f\n",
              sigma(one, false) / distance, sigma(one, true) / distance,
              sigma(both, false) / distance, sigma(both, true) / distance);
  EXPECT_LT(sigma(one, true), 1.01 * sigma(one, false));
  EXPECT_GT(sigma(both, true), 1.1 * sigma(both, false));
}

}  // namespace
}  // namespace diorama
