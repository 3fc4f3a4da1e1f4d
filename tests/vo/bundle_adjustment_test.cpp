// What bundle adjustment must not leave where it is.
#include "vo/bundle_adjustment.h"

#include <gtest/gtest.h>

#include "tests/vo/wall.h"

namespace diorama::vo {
namespace {

using test::gridOfPixels;
using test::pointOnWall;
using test::wallCamera;

// A camera goes past two pieces of a wall 2 m away. The second comes into view at the fourth
// keyframe, and a few points of the first are seen from the fifth, 1 cm farther, too: they say all
// that is known of how far it goes from there.
struct TwoPieces {
  explicit TwoPieces(double too_long) {
    for (const double x : x_m) {
      TrackedFrame frame;
      frame.T_world_camera.translation = stretched({x, 0, 0}, too_long);
      map.addKeyframe(frame);
    }
    size_t count = 0;
    for (const Vector2d& u : gridOfPixels(40, 40)) {
      const Vector3d p = pointOnWall(u);
      addPoint(p, p, 0, count++ % 16 == 0 ? kTurn + 1 : kTurn);
      const Vector3d q = p + Vector3d(1, 0, 0);
      addPoint(q, stretched(q, too_long), kTurn, x_m.size() - 1);
    }
  }
  // About the camera of the fourth keyframe, what lies beyond it.
  Vector3d stretched(const Vector3d& p, double factor) const {
    const Vector3d centre(x_m[kTurn], 0, 0);
    return p.x() <= centre.x() && p.z() == 0 ? p : Vector3d(centre + factor * (p - centre));
  }
  void addPoint(const Vector3d& p, const Vector3d& believed, size_t first, size_t last) {
    const auto seen = [&](size_t k) {
      return Measured{wallCamera().project(p - Vector3d(x_m[k], 0, 0)).value()};
    };
    MapPoint& point = map.addPoint(*map.keyframes[first], believed, seen(first));
    for (size_t k = first + 1; k <= last; ++k) {
      point.observations.push_back({seen(k), map.keyframes[k].get()});
      map.keyframes[k]->features.push_back({seen(k), &point});
    }
  }
  double metresFromTurn() const {
    return map.keyframes.back()->T_world_camera.translation.x() -
           map.keyframes[kTurn]->T_world_camera.translation.x();
  }

  static constexpr size_t kTurn = 3;
  const std::vector<double> x_m{0, 0.1, 0.2, 0.3, 0.31, 0.5, 0.7, 0.9, 1.1};
  Map map;
};

TEST(BundleAdjustment, FindsALengthOfWhichLittleIsKnown) {
  TwoPieces pieces(1.09);
  ASSERT_NEAR(pieces.metresFromTurn(), 1.09 * 0.8, 1e-9);
  const VoOptions options;
  adjustBundle(wallCamera(), pieces.map, {8, options.bundle_iterations, false, 0}, options);
  EXPECT_NEAR(pieces.metresFromTurn(), 0.8, 0.008);
}

}  // namespace
}  // namespace diorama::vo
