// Where something stands before the map.
#include "vo/hidden_regions.h"

#include <gtest/gtest.h>

#include "tests/vo/wall.h"
#include "vo/map.h"

namespace diorama::vo {
namespace {

using test::gridOfPixels;
using test::pointOnWall;
using test::wallCamera;

// Points every 20 px on the wall; those for which `seen` holds are the frame's features.
struct View {
  explicit View(const std::function<bool(const Vector2d&)>& seen) {
    for (const Vector2d& u : gridOfPixels(20, 20)) {
      points.push_back(std::make_unique<MapPoint>());
      points.back()->p_world = pointOnWall(u);
      if (seen(u))
        frame.features.push_back({{u}, points.back().get()});
      else
        failed.push_back(points.back().get());
    }
    hidden = HiddenRegions(wallCamera(), frame, failed);
  }
  std::vector<std::unique_ptr<MapPoint>> points;
  TrackedFrame frame;
  std::vector<MapPoint*> failed;
  HiddenRegions hidden;
};

TEST(HiddenRegions, NothingIsHiddenAtFirstAndWhenAllIsSeen) {
  EXPECT_FALSE(HiddenRegions().any());
  EXPECT_FALSE(HiddenRegions().contains({3, 4}));
  EXPECT_FALSE(View([](const Vector2d&) { return true; }).hidden.any());
}

TEST(HiddenRegions, AreWhatABoardCovers) {
  const View view([](const Vector2d& u) { return u.x() < 320; });
  EXPECT_FALSE(view.hidden.contains({100, 240}));
  EXPECT_FALSE(view.hidden.contains({300, 20}));
  EXPECT_TRUE(view.hidden.contains({340, 240}));
  EXPECT_TRUE(view.hidden.contains({639, 479}));
}

TEST(HiddenRegions, IsSeenWhereKnownPointsAreOrAroundThem) {
  EXPECT_FALSE(HiddenRegions().isSeen({3, 4}));
  View view([](const Vector2d& u) { return u.x() < 320; });
  EXPECT_TRUE(view.hidden.isSeen({100, 240}));
  EXPECT_TRUE(view.hidden.isSeen({310, 240}));
  EXPECT_FALSE(view.hidden.isSeen({330, 240}));
  EXPECT_FALSE(view.hidden.isSeen({639, 479}));

  // Where nothing is known and nothing around is hidden: the same; beside what is hidden: not.
  const auto without = [&](const Vector2d& centre) {
    TrackedFrame frame = view.frame;
    std::erase_if(frame.features,
                  [&](const Feature& f) { return (f.u_px - centre).cwiseAbs().maxCoeff() < 40; });
    return HiddenRegions(wallCamera(), frame, view.failed).isSeen(centre);
  };
  EXPECT_TRUE(without({120, 200}));
  EXPECT_FALSE(without({280, 200}));
}

TEST(HiddenRegions, FailuresHereAndThereHideNothing) {
  int count = 0;
  const View view([&](const Vector2d&) { return ++count % 2 == 0; });
  EXPECT_FALSE(view.hidden.any());
}

TEST(HiddenRegions, WhereNothingIsKnownItIsAsAround) {
  View view([](const Vector2d& u) { return u.x() < 320; });
  const auto drop = [](const Vector2d& u) {
    return u.x() > 480 && u.x() < 560 && u.y() > 160 && u.y() < 240;
  };
  std::erase_if(view.failed,
                [&](const MapPoint* p) { return drop(wallCamera().project(p->p_world).value()); });
  EXPECT_TRUE(HiddenRegions(wallCamera(), view.frame, view.failed).contains({520, 200}));
  EXPECT_FALSE(HiddenRegions(wallCamera(), {}, {}).any());
}

}  // namespace
}  // namespace diorama::vo
