#include "tracker/database_detector.h"

#include <gmock/gmock.h>

#include "core/errors.h"
#include "tests/support/matchers.h"
#include "tests/tracker/box_scene.h"
#include "tracker/chamfer_maps.h"
#include "tracker/edge_templates.h"
#include "tracker/view_sphere.h"

// Read by the thread sanitizer, which does not see how OpenCV's own threads wait for one another.
extern "C" const char* __tsan_default_suppressions() { return "race:libopencv_\n"; }

namespace diorama {
namespace {

// The box alone, one ray a pixel.
Frame boxFrom(const SE3& T_camera_object, const test::BoxScene& scene) {
  const Camera& camera = trainingCamera();
  const SE3 T = T_camera_object.inverse();
  Frame frame;
  frame.gray = Image<uint8_t>(camera.width(), camera.height());
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      const Vector2d u(x, y);
      const double grey = scene.grey(T.translation, T.rotation * *camera.unproject(u), u);
      frame.gray(x, y) = static_cast<uint8_t>(grey);
    }
  return frame;
}

TrainingOptions quickTraining() {
  TrainingOptions options;
  options.views = 16;
  options.distances = 1;
  options.nearest_diameters = 2;
  return options;
}

// An upright box, three of its faces towards the camera.
SE3 seenFrom(const Vector3d& direction, double distance) {
  SE3 T = viewFrom(direction, distance, Vector3d(0, 0, 0.1));
  T.translation += Vector3d(0.02, -0.01, 0);
  return T;
}

struct Rig {
  explicit Rig(double print) {
    scene.print = print;
    const ObjectModel model = scene.object();
    test::BoxScene alone = scene;
    alone.clutter = 0;
    const std::vector<SE3> views = trainingViews(model.mesh, quickTraining());
    const auto picture = [&](int k) { return boxFrom(views[static_cast<size_t>(k)], alone); };
    database = trainDatabase(model, scene.rays, 0, picture, quickTraining());
  }
  DatabaseDetector detector(const DetectorOptions& options = {}) const {
    return {{{scene.object(), database}},
            scene.camera,
            std::make_shared<test::BoxRays>(scene.box),
            options,
            {}};
  }
  test::BoxScene scene;
  ObjectDatabase database;
};

const int kOnly[] = {0};

TEST(DatabaseDetector, FindsAPrintedBox) {
  const Rig rig(40);
  EXPECT_GT(rig.database.features.size(), 100u);
  DatabaseDetector detector = rig.detector();
  for (const Vector3d& side : {Vector3d(1, 0.7, 0.6), Vector3d(-0.4, 1, 0.5)}) {
    const SE3 T = seenFrom(side, 0.5);
    const Frame frame = rig.scene.draw(T, 0);
    const auto found = detector.detect(frame, kOnly);
    ASSERT_TRUE(found.at(0));
    EXPECT_THAT(found[0]->T_camera_object, test::PoseNear(T, 0.01, 0.03));
    EXPECT_GT(found[0]->inliers, 0);
    EXPECT_EQ(detector.detect(frame, kOnly)[0]->T_camera_object.translation,
              found[0]->T_camera_object.translation);
  }
}

// Something dark hides what lies above a height in the object's frame.
Frame hiddenAbove(double height_m, const SE3& T, const Rig& rig) {
  Frame frame = rig.scene.draw(T, 0);
  const double rim = rig.scene.camera.project(T * Vector3d(0, 0, height_m))->y();
  for (int y = 0; y < rim; ++y)
    for (int x = 0; x < frame.gray.width; ++x) frame.gray(x, y) = 20;
  return frame;
}

TEST(DatabaseDetector, FindsWhatIsPartlyHidden) {
  const Rig rig(40);
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  const auto foundWith = [&](int proving_features) {
    DetectorOptions options;
    options.proving_features = proving_features;
    return rig.detector(options).detect(hiddenAbove(0.16, T, rig), kOnly).at(0);
  };
  const auto by_print = foundWith(6);  // it has few: its print is smooth
  ASSERT_TRUE(by_print);
  EXPECT_GT(by_print->inliers, 0);
  EXPECT_THAT(by_print->T_camera_object, test::PoseNear(T, 0.01, 0.03));
  const auto by_edges = foundWith(1000);
  ASSERT_TRUE(by_edges);
  EXPECT_EQ(by_edges->inliers, 0);
  EXPECT_THAT(by_edges->T_camera_object, test::PoseNear(T, 0.01, 0.03));
}

TEST(DatabaseDetector, FindsNothingInClutter) {
  const Rig rig(40);
  DatabaseDetector detector = rig.detector();
  EXPECT_FALSE(detector.detect(rig.scene.draw(SE3{}, 0, true), kOnly).at(0));
}

TEST(DatabaseDetector, FindsAPlainBoxByItsEdges) {
  const Rig rig(0);
  DatabaseDetector detector = rig.detector();
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.4);
  const auto found = detector.detect(rig.scene.draw(T, 0), kOnly);
  ASSERT_TRUE(found.at(0));
  EXPECT_EQ(found[0]->inliers, 0);
  // A quarter turn looks the same without print.
  double nearest = 1;
  for (int k = 0; k < 4; ++k) {
    const Eigen::AngleAxisd turn(k * std::numbers::pi / 2, Vector3d::UnitZ());
    nearest = std::min(nearest, angleBetween(found[0]->T_camera_object.rotation,
                                             T.rotation * Eigen::Quaterniond(turn)));
  }
  EXPECT_LT(nearest, 0.05);
  EXPECT_LT((found[0]->T_camera_object.translation - T.translation).norm(), 0.015);
}

// Colours for the grey values, each channel so many times as bright.
Frame colored(Frame frame, const Vector3d& tint) {
  frame.rgb = Image<Rgb8>(frame.gray.width, frame.gray.height);
  const auto toByte = [](double v) { return static_cast<uint8_t>(std::min(v, 255.0)); };
  for (size_t i = 0; i < frame.gray.pixels.size(); ++i) {
    const Vector3d c = tint * frame.gray.pixels[i];
    frame.rgb.pixels[i] = {toByte(c[0]), toByte(c[1]), toByte(c[2])};
  }
  return frame;
}

const Vector3d kGrey(1, 1, 1), kWarm(1.1, 1, 0.9), kRed(1.2, 0.6, 0.6);

TEST(DatabaseDetector, SomethingPlainOfAnotherColourIsSomethingElse) {
  const Rig rig(0);
  ObjectModel model = rig.scene.object();
  const auto detectorOf = [&] {
    return DatabaseDetector({{model, rig.database}}, rig.scene.camera,
                            std::make_shared<test::BoxRays>(rig.scene.box));
  };
  EXPECT_FALSE(model.mesh.hasMaterials());
  DatabaseDetector without_colors = detectorOf();
  model.mesh.materials.emplace_back().name = "paint";
  DatabaseDetector detector = detectorOf();
  const Frame frame = rig.scene.draw(seenFrom(Vector3d(1, 0.7, 0.6), 0.4), 0);
  EXPECT_TRUE(detector.detect(colored(frame, kGrey), kOnly).at(0));
  EXPECT_TRUE(detector.detect(colored(frame, kWarm), kOnly).at(0));
  EXPECT_FALSE(detector.detect(colored(frame, kRed), kOnly).at(0));
  EXPECT_TRUE(without_colors.detect(colored(frame, kRed), kOnly).at(0)) << "its edges are enough";
}

TEST(EdgeTemplates, KnowWhatLooksAlikeFromSeveralSides) {
  const test::BoxScene scene;  // upright, its base is a square
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(scene.object().mesh, options);
  const EdgeTemplates templates(model, scene.camera, scene.rays, 0, options, {.views = 4}, {});
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  const auto turned = [&](double angle_rad) {
    const Eigen::AngleAxisd turn(angle_rad, Vector3d::UnitZ());
    return T * SE3{Eigen::Quaterniond(turn), Vector3d::Zero()};
  };
  EXPECT_TRUE(templates.areDrawnAlike(T, turned(std::numbers::pi / 2)));
  EXPECT_TRUE(templates.areDrawnAlike(T, turned(std::numbers::pi)));
  EXPECT_FALSE(templates.areDrawnAlike(T, turned(std::numbers::pi / 4)));
  EXPECT_FALSE(templates.areDrawnAlike(turned(0.2), T));
}

TEST(DatabaseDetector, AnotherMeshOrImageSizeIsNoCrash) {
  Rig rig(40);
  DatabaseDetector detector = rig.detector();
  Frame tiny;
  tiny.gray = Image<uint8_t>(1, 1);
  EXPECT_FALSE(detector.detect(tiny, kOnly).at(0));
  EXPECT_TRUE(detector.detect(tiny, {}).empty());
  rig.scene.box.high.z() = 0.21;
  EXPECT_THROW(rig.detector(), InputError);
}

TEST(DatabaseDetector, WorksOnAnImageOfOnePixel) {
  Rig rig(40);
  rig.scene.camera = Camera{CameraParameters{CameraModel::kPinhole, 1, 1, 300, 300, 0, 0, {}}};
  DatabaseDetector detector = rig.detector();
  Frame tiny;
  tiny.gray = Image<uint8_t>(1, 1);
  EXPECT_FALSE(detector.detect(tiny, kOnly).at(0));
}

TEST(Features, BothKindsAreRepeatable) {
  const test::BoxScene scene;
  const Frame frame = scene.draw(test::boxPose(), 0);
  for (const FeatureKind kind : {FeatureKind::kSift, FeatureKind::kSurf}) {
    const Features features = extractFeatures(frame.gray, kind, 50);
    EXPECT_GT(features.points.size(), 10u) << toString(kind);
    EXPECT_LE(features.points.size(), 50u) << toString(kind);
    EXPECT_EQ(features.descriptors.size(),
              features.points.size() * static_cast<size_t>(descriptorSize(kind)));
    EXPECT_EQ(extractFeatures(frame.gray, kind, 50).descriptors, features.descriptors);
    EXPECT_TRUE(extractFeatures(Image<uint8_t>(1, 1), kind, 50).points.empty());
    EXPECT_EQ(featureKindFromString(toString(kind)), kind);
  }
}

TEST(Features, LargeOnesLieWhereTheyAre) {
  const Frame frame = test::BoxScene().draw(test::boxPose(), 0);
  const Features all = extractFeatures(frame.gray, FeatureKind::kSift, 2000);
  const Features large = extractLargeFeatures(frame.gray, FeatureKind::kSift, 50);
  ASSERT_GT(large.points.size(), 10u);
  int near = 0;
  Vector2d sum = Vector2d::Zero();
  for (const Features::Point& point : large.points) {
    Vector2d best(9, 9);
    for (const Features::Point& other : all.points)
      if (const Vector2d d = point.u_px - other.u_px; d.norm() < best.norm()) best = d;
    if (best.norm() > 1) continue;
    ++near;
    sum += best;
  }
  EXPECT_GT(2 * near, static_cast<int>(large.points.size()));
  EXPECT_LT((sum / near).norm(), 0.25);  // half a pixel off would be another centre
  EXPECT_TRUE(extractLargeFeatures(Image<uint8_t>(1, 1), FeatureKind::kSurf, 9).points.empty());
}

TEST(CompareLooks, ColoursTellWhatGreyValuesDoNot) {
  const Rig printed(40);
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  Frame frame = printed.scene.draw(T, 0);
  std::vector<DatabaseLook> looks = printed.database.looks;
  frame.rgb = Image<Rgb8>(frame.gray.width, frame.gray.height);
  for (size_t i = 0; i < frame.gray.pixels.size(); ++i) {
    const uint8_t g = frame.gray.pixels[i];
    frame.rgb.pixels[i] = {g, g, g};
  }
  const auto look = [&] {
    return *compareLooks(looks, MeanImage(frame), printed.scene.camera, T, Vector3d(0, 0, 0.1));
  };
  const double grey = look();
  EXPECT_GT(grey, 0.8);
  // Now every other point of the object is known to be red.
  for (DatabaseLook& known : looks)
    for (size_t i = 0; i < known.colors.size(); i += 2) known.colors[i].g = known.colors[i].b = 10;
  EXPECT_LT(look(), grey - 0.2);
}

TEST(CompareLooks, TellsTheRightPoseFromAWrongOneAndFromAPlainObject) {
  const Rig printed(40), plain(0);
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  const Vector3d centre(0, 0, 0.1);
  const auto look = [&](const Rig& rig, const SE3& pose) {
    return compareLooks(rig.database.looks, MeanImage(rig.scene.draw(T, 0)), rig.scene.camera, pose,
                        centre);
  };
  const SE3 half_turn{Eigen::Quaterniond(0, 0, 0, 1), Vector3d::Zero()};
  ASSERT_TRUE(look(printed, T));
  EXPECT_GT(*look(printed, T), 0.8);
  EXPECT_LT(*look(printed, T * half_turn), 0.5);
  EXPECT_FALSE(look(plain, T));  // its faces differ by their light only
  EXPECT_TRUE(isPlain(plain.database.looks[0]));
  EXPECT_FALSE(isPlain(printed.database.looks[0]));
  EXPECT_FALSE(look(printed, seenFrom(Vector3d(0, 0, 1), -0.5)));  // behind the camera
}

TEST(CompareColors, TellThoseOfSomethingPlainInAnyLight) {
  const Rig rig(0);
  ASSERT_TRUE(arePlain(rig.database.looks));
  EXPECT_FALSE(arePlain(Rig(40).database.looks));
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  const Frame frame = rig.scene.draw(T, 0);
  const auto colors = [&](const Frame& picture, const SE3& pose) {
    return compareColors(rig.database.looks, MeanImage(picture), rig.scene.camera, pose,
                         Vector3d(0, 0, 0.1));
  };
  const auto of = [&](const Vector3d& tint) { return colors(colored(frame, tint), T).value(); };
  EXPECT_GT(of(kGrey), 0.8);
  EXPECT_GT(of(kWarm), 0.5);
  EXPECT_LT(of(kRed), -0.3);
  EXPECT_FALSE(colors(frame, T)) << "grey";
  EXPECT_FALSE(colors(frame, seenFrom(Vector3d(0, 0, 1), -0.5))) << "behind the camera";
}

TEST(CompareLooks, OfThePartThatSomethingStraightLeaves) {
  const Rig rig(40);
  const SE3 T = seenFrom(Vector3d(1, 0.7, 0.6), 0.5);
  const Vector3d centre(0, 0, 0.1);
  const auto look = [&](const Frame& frame, const SE3& pose) {
    return compareLooksInPart(rig.database.looks, MeanImage(frame), rig.scene.camera, pose, centre,
                              0.5);
  };
  const PartialLook whole = look(rig.scene.draw(T, 0), T);
  EXPECT_EQ(whole.share, 1);
  EXPECT_TRUE(whole.part.contains({1e6, -1e6}));
  const Frame hidden = hiddenAbove(0.13, T, rig);
  const PartialLook left = look(hidden, T);
  EXPECT_LT(*compareLooks(rig.database.looks, MeanImage(hidden), rig.scene.camera, T, centre), 0.6);
  EXPECT_GT(left.agreement.value_or(0), 0.75);
  EXPECT_LT(left.share, 0.95);
  EXPECT_TRUE(left.part.contains(*rig.scene.camera.project(T * Vector3d(0, 0, 0.05))));
  EXPECT_FALSE(left.part.contains(*rig.scene.camera.project(T * Vector3d(0, 0, 0.19))));
  // Half of a wrong pose happens to agree, but not so well.
  const SE3 half_turn{Eigen::Quaterniond(0, 0, 0, 1), Vector3d::Zero()};
  const PartialLook wrong = look(hidden, T * half_turn);
  EXPECT_LT(wrong.agreement.value_or(0) - 0.5 * (1 - wrong.share), 0.5);
}

TEST(ChamferMaps, SeeEdgesOfColoursOfOneBrightness) {
  Frame frame;
  frame.gray = Image<uint8_t>(320, 240, 120);
  const auto distanceAt = [&](double x) {
    return ChamferMaps(frame, {}).sample({x, 100}, ChamferMaps::directionOf({1, 0})).distance_px;
  };
  EXPECT_EQ(distanceAt(160), ChamferOptions().farthest_px);
  frame.rgb = Image<Rgb8>(320, 240, {120, 120, 120});
  for (int y = 0; y < 240; ++y)
    for (int x = 160; x < 320; ++x) frame.rgb(x, y) = {180, 110, 20};
  EXPECT_LT(distanceAt(160), 1.5);
  EXPECT_NEAR(distanceAt(170), 10, 1.5);
}

TEST(MeanImage, IsTheMeanOfWholePixelsInside) {
  Frame frame;
  frame.gray = Image<uint8_t>(4, 3);
  frame.rgb = Image<Rgb8>(4, 3);
  for (size_t i = 0; i < frame.gray.pixels.size(); ++i) {
    const uint8_t value = frame.gray.pixels[i] = static_cast<uint8_t>(i);
    frame.rgb.pixels[i] = {value, static_cast<uint8_t>(2 * value), 7};
  }
  EXPECT_EQ(MeanImage(frame).mean({1, 1}, 3), Vector3f(5, 10, 7));
  frame.rgb = {};
  const MeanImage means(frame);
  EXPECT_FALSE(means.hasColors());
  EXPECT_EQ(means.mean({1, 1}, 1), Vector3f(5, 5, 5));
  EXPECT_EQ(means.mean({1, 1}, 3), Vector3f(5, 5, 5));
  EXPECT_EQ(means.mean({0, 0}, 3), std::nullopt);
  EXPECT_EQ(means.mean({1e12, 1}, 1), std::nullopt);
}

TEST(ViewSphere, LooksAtTheCentreFromAllAround) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& direction : sphereDirections(60)) {
    EXPECT_NEAR(direction.norm(), 1, 1e-12);
    sum += direction;
    const Vector3d centre(0.1, -0.2, 0.3);
    const SE3 T = viewFrom(direction, 0.7, centre);
    EXPECT_LT((T * centre - Vector3d(0, 0, 0.7)).norm(), 1e-12);
    EXPECT_LT((T.inverse().translation - centre - 0.7 * direction).norm(), 1e-12);
    EXPECT_LE((T.rotation * Vector3d::UnitZ()).y(), 1e-12);  // upwards in the image
  }
  EXPECT_LT(sum.norm() / 60, 0.02);
}

}  // namespace
}  // namespace diorama
