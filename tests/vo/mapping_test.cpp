// What enters the map from a view that something covers in part.
#include "vo/mapping.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/vo/wall.h"

namespace diorama::vo {
namespace {

using test::gridOfPixels;
using test::pointOnWall;
using test::wallCamera;

std::shared_ptr<const ImagePyramid> blank() {
  static const auto pyramid = std::make_shared<const ImagePyramid>(Image<uint8_t>(640, 480, 90),
                                                                   VoOptions{}.pyramid_levels);
  return pyramid;
}

// A keyframe before a wall 2 m away. In the second one, half a metre to the side, the wall's known
// points are found left of the middle and not right of it; corners without a depth are found on
// both sides.
struct CoveredView {
  explicit CoveredView(bool covered) {
    TrackedFrame first;
    first.pyramid = blank();
    Keyframe& host = mapping.map().addKeyframe(first);
    mapping.begin(true);
    frame.timestamp_ns = 1'000'000'000;
    frame.pyramid = blank();
    frame.T_world_camera.translation.x() = 0.5;
    frame.covered = covered;
    std::vector<MapPoint*> failed;
    int count = 0;
    for (const Vector2d& u : gridOfPixels(20, 40)) {
      const bool known = ++count % 2 == 0;
      const Vector3d p = frame.T_world_camera * pointOnWall(u);
      const auto before = wallCamera().project(p);
      MapPoint& point = mapping.map().addPoint(host, p, {before.value_or(u)});
      point.settled = known;
      if (known && u.x() > 320)
        failed.push_back(&point);
      else
        frame.features.push_back({{u}, &point});
    }
    frame.hidden = HiddenRegions(wallCamera(), frame, failed);
  }
  // Unsettled features right or left of the middle that the map's newest keyframe has.
  int entered(bool right) {
    std::vector<const MapPoint*> corners;
    for (const Feature& f : frame.features)
      if (!f.point->settled && (f.u_px.x() > 320) == right) corners.push_back(f.point);
    mapping.update(frame, 0, {});
    EXPECT_EQ(mapping.map().keyframes.size(), 2u);
    return static_cast<int>(std::count_if(corners.begin(), corners.end(),
                                          [](const MapPoint* point) { return point->settled; }));
  }

  VoOptions options;
  Mapping mapping{wallCamera(), options};
  TrackedFrame frame;
};

TEST(Mapping, CornersOfWhatCoversTheMapDoNotEnterIt) {
  EXPECT_EQ(CoveredView(true).entered(true), 0);
  EXPECT_GT(CoveredView(true).entered(false), 50);
}

TEST(Mapping, WhereLittleIsCoveredAllCornersEnter) {
  EXPECT_GT(CoveredView(false).entered(true), 50);
  EXPECT_GT(CoveredView(false).entered(false), 50);
}

}  // namespace
}  // namespace diorama::vo
