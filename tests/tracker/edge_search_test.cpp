#include "tracker/edge_search.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

// Nothing hides anything.
class NoRays : public RayQuery {
 public:
  void occluded(int, const Vector3d&, std::span<const Vector3d>,
                std::span<uint8_t> occluded) const override {
    std::fill(occluded.begin(), occluded.end(), uint8_t{0});
  }
  std::optional<RayHit> closestHit(int, const Vector3d&, const Vector3d&) const override {
    return std::nullopt;
  }
};

// A long thin sheet: its two long edges are 0.2 m apart.
Mesh sheet() {
  Mesh mesh;
  mesh.positions = {{-0.2f, -0.1f, 0}, {0.2f, -0.1f, 0}, {0.2f, 0.1f, 0}, {-0.2f, 0.1f, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Mesh cylinder(int sides, float radius, float height) {
  Mesh mesh;
  for (int i = 0; i < sides; ++i) {
    const float a =
        2 * std::numbers::pi_v<float> * static_cast<float>(i) / static_cast<float>(sides);
    for (const float z : {-height / 2, height / 2})
      mesh.positions.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
    const int j = (i + 1) % sides;
    mesh.triangles.emplace_back(2 * i, 2 * j, 2 * j + 1);
    mesh.triangles.emplace_back(2 * i, 2 * j + 1, 2 * i + 1);
  }
  return mesh;
}

double blurredStep(double distance_px, double sigma_px) {
  return 0.5 * (1 + std::erf(distance_px / (std::numbers::sqrt2 * sigma_px)));
}

// Pixels mix light; the grey value is about its root.
float greyOf(double light) { return static_cast<float>(std::sqrt(light)); }

EdgeProfile profileOf(const float* grey, int length) {
  EdgeProfile profile;
  profile.length = length;
  for (int i = 0; i < length; ++i) {
    profile.grey[i] = profile.value[i] = grey[i];
    profile.light[i] = grey[i] * grey[i];
  }
  return profile;
}

TEST(ProfileEdges, SubPixelPlaceOfABlurredStep) {
  for (const double sigma : {0.7, 1.0, 1.6, 2.5})
    for (double place = -2; place <= 2; place += 0.1) {
      float profile[23];
      for (int i = 0; i < 23; ++i)
        profile[i] = greyOf(60 * 60 + (160 * 160 - 60 * 60) * blurredStep(i - 11 - place, sigma));
      EdgeCandidate found[3];
      ASSERT_EQ(findProfileEdges(profileOf(profile, 23), 6, found, 3), 1) << sigma << ' ' << place;
      EXPECT_NEAR(found[0].offset_px, place, 0.05) << sigma;
      EXPECT_GT(found[0].contrast.gradient, 0);
      EXPECT_GT(found[0].contrast.after, found[0].contrast.before);
    }
}

// A dark thing on a bright table, whose contact shadow fades over some pixels.
TEST(ProfileEdges, ShadowBehindAStepDrawsItOnlyALittle) {
  for (double place = -1; place <= 1; place += 0.1) {
    float profile[23];
    for (int i = 0; i < 23; ++i) {
      const double x = i - 11 - place, table = 16000 * (0.7 + 0.3 * std::clamp(x / 5, 0.0, 1.0));
      profile[i] = greyOf(2500 + (table - 2500) * blurredStep(x, 0.8));
    }
    EdgeCandidate found[3];
    ASSERT_GE(findProfileEdges(profileOf(profile, 23), 6, found, 3), 1) << place;
    EXPECT_NEAR(found[0].offset_px, place, 0.25);
  }
}

TEST(ProfileEdges, KeepsTheStrongest) {
  float profile[41];
  const double places[] = {-12, -6, 0, 6, 12}, heights[] = {30, -60, 40, 80, -20};
  for (int i = 0; i < 41; ++i) {
    double grey = 100;
    for (int k = 0; k < 5; ++k) grey += heights[k] * blurredStep(i - 20 - places[k], 1);
    profile[i] = static_cast<float>(grey);
  }
  EdgeCandidate found[3];
  ASSERT_EQ(findProfileEdges(profileOf(profile, 41), 6, found, 3), 3);
  double sum = 0;
  for (const EdgeCandidate& c : found) sum += std::abs(c.offset_px);
  EXPECT_NEAR(sum, 12, 0.5);  // -6, 0 and 6
  EdgeCandidate all[8];
  EXPECT_EQ(findProfileEdges(profileOf(profile, 41), 6, all, 8), 5);
  EXPECT_EQ(findProfileEdges(profileOf(profile, 41), 18, all, 8), 2);
}

TEST(ProfileEdges, FlatProfilesHaveNone) {
  float profile[23];
  std::fill(std::begin(profile), std::end(profile), 77.f);
  EdgeCandidate found[3];
  EXPECT_EQ(findProfileEdges(profileOf(profile, 23), 6, found, 3), 0);
  EXPECT_EQ(findProfileEdges(profileOf(profile, 23), 0.f, found, 3), 0);
}

// Orange against a blue that is as bright.
TEST(ProfileEdges, ColorsThatAreAsBrightAsOneAnother) {
  const Rgb8 left{200, 120, 60}, right{90, 160, 150};
  const Image<uint8_t> grey = toGray(Image<Rgb8>(1, 1, left)), other = toGray({1, 1, right});
  ASSERT_NEAR(grey(0, 0), other(0, 0), 3);
  for (double place = -1; place <= 1; place += 0.25) {
    Image<Rgb8> image(60, 20);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 60; ++x) {
        const double share = std::clamp(x + 0.5 - 30 - place, 0.0, 1.0);  // of the right one
        const auto mix = [&](uint8_t a, uint8_t b) {
          return static_cast<uint8_t>(std::lround(std::sqrt((1 - share) * a * a + share * b * b)));
        };
        image(x, y) = {mix(left.r, right.r), mix(left.g, right.g), mix(left.b, right.b)};
      }
    EdgeProfile profile;
    EdgeCandidate found[3];
    const Vector2d middle(30, 10), across(1, 0);
    readGreyProfile(toGray(image), middle, across, 8, profile);
    EXPECT_EQ(findProfileEdges(profile, 6, found, 3), 0);
    readColorProfile(image, middle, across, profile);
    ASSERT_EQ(findProfileEdges(profile, 6, found, 3), 1);
    EXPECT_NEAR(found[0].offset_px, place, 0.1);
    EXPECT_GT(std::abs(found[0].contrast.gradient), 20);
  }
}

// The sheet fills a half plane of the image whose outline is moved by `shift_px`, at any angle.
class EdgeSearchAngle : public testing::TestWithParam<double> {};

TEST_P(EdgeSearchAngle, FindsAnEdgeToATenthOfAPixel) {
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(sheet(), options);
  const Camera camera(
      CameraParameters{CameraModel::kPinhole, 320, 240, 300, 300, 160.3, 119.6, {}});
  const NoRays rays;
  const EdgeSearch search(model, camera, rays, 0, options);
  const std::vector<Contrast> memory(model.samples.size());
  const SE3 T{expSO3(Vector3d(0, 0, GetParam())), Vector3d(0.01, -0.013, 1)};
  // The upper long edge, y = 0.1 m, is 30 px from the centre along the turned y axis.
  const Vector2d across(-std::sin(GetParam()), std::cos(GetParam()));
  const Vector2d on_edge = *camera.project(T * Vector3d(0, 0.1, 0));
  for (const double shift : {-3.3, -0.62, 0.0, 0.25, 1.4, 4.8}) {
    Image<uint8_t> image(320, 240);
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 320; ++x)
        image(x, y) = static_cast<uint8_t>(
            0.5f +
            greyOf(3600 + 28800 * blurredStep(across.dot(Vector2d(x, y) - on_edge) - shift, 1.0)));
    int count = 0;
    const std::vector<int> samples = search.visibleSamples(T);
    for (const EdgeObservation& o : search.search(image, T, samples, memory, 8)) {
      const EdgeSample& s = model.samples[static_cast<size_t>(o.sample)];
      if (s.p.y() < 0.099 || std::abs(s.p.x()) > 0.19) continue;
      ASSERT_EQ(o.candidate_count, 1);
      EXPECT_NEAR(o.normal.dot(across) * o.candidates[0].offset_px, shift, 0.1);
      ++count;
    }
    EXPECT_GT(count, 8);
  }
}
INSTANTIATE_TEST_SUITE_P(Angles, EdgeSearchAngle, testing::Values(0.0, 0.2, 0.785, 1.4, 2.5));

// An edge smeared over ten pixels by a motion of twelve since the last frame, under noise.
TEST(EdgeSearch, FindsSmearedEdgesInLongerSteps) {
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(sheet(), options);
  const Camera camera(
      CameraParameters{CameraModel::kPinhole, 320, 240, 300, 300, 160.3, 119.6, {}});
  const NoRays rays;
  const EdgeSearch search(model, camera, rays, 0, options);
  const std::vector<Contrast> memory(model.samples.size());
  const SE3 T{Eigen::Quaterniond::Identity(), Vector3d(0.01, -0.013, 1)};
  const double edge = camera.project(T * Vector3d(0, 0.1, 0))->y();
  const Random random(4, RandomStream::kTest);
  Image<uint8_t> image(320, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const double smeared = std::clamp((y - edge) / 10 + 0.5, 0.0, 1.0);
      const double noise = 3 * random.normal(static_cast<uint32_t>(y), static_cast<uint64_t>(x))[0];
      image(x, y) = static_cast<uint8_t>(std::lround(100 + 40 * smeared + noise));
    }
  const auto near = [&](const std::optional<SE3>& T_before) {
    int found = 0;
    const std::vector<int> samples = search.visibleSamples(T);
    for (const EdgeObservation& o : search.search(image, T, samples, memory, 6, T_before)) {
      const EdgeSample& s = model.samples[static_cast<size_t>(o.sample)];
      if (s.p.y() < 0.099 || std::abs(s.p.x()) > 0.19) continue;
      EXPECT_EQ(o.step_px, T_before ? 3 : 1);
      found += std::abs(o.candidates[0].offset_px) < 1.5;
    }
    return found;
  };
  SE3 before = T;
  before.translation.y() -= 12 / 300.;
  EXPECT_LT(near(std::nullopt), 5);
  EXPECT_GT(near(before), 10);
}

TEST(EdgeSearch, CylinderShowsItsSilhouette) {
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(cylinder(64, 0.04f, 0.2f), options);
  const Camera camera(CameraParameters{CameraModel::kPinhole, 640, 480, 500, 500, 320, 240, {}});
  const NoRays rays;
  const EdgeSearch search(model, camera, rays, 0, options);
  const double distance = 0.6;
  // Seen from the side, the axis upright in the image.
  const SE3 T{expSO3(Vector3d(std::numbers::pi / 2, 0, 0)), Vector3d(0, 0, distance)};
  const Vector3d eye = T.inverse().translation;
  int left = 0, right = 0;
  for (const int i : search.visibleSamples(T)) {
    const EdgeSample& s = model.samples[static_cast<size_t>(i)];
    if (model.edges[static_cast<size_t>(s.edge)].kind != EdgeKind::kSmooth) continue;
    // The rim is where the surface turns away: within one side of the mesh of grazing.
    const Vector3d normal = Vector3d(s.p.x(), s.p.y(), 0).normalized();
    EXPECT_LT(std::abs(normal.dot((s.p - eye).normalized())), 2 * std::numbers::pi / 64);
    (s.p.x() < 0 ? left : right)++;
  }
  EXPECT_GT(left, 5);
  EXPECT_GT(right, 5);
}

TEST(EdgeSearch, HiddenSamplesAreLeftOut) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const EdgeSearch search(model, scene.camera, scene.rays, 0, options);
  const SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  const Vector3d eye = T.inverse().translation;
  const std::vector<int> samples = search.visibleSamples(T);
  EXPECT_GT(samples.size(), 60u);
  for (const int i : samples) {  // one of the two faces must look at the camera
    const ModelEdge& e =
        model.edges[static_cast<size_t>(model.samples[static_cast<size_t>(i)].edge)];
    const Vector3d view = model.samples[static_cast<size_t>(i)].p - eye;
    const Vector3d p = model.samples[static_cast<size_t>(i)].p;
    const double out1 = p.dot(e.n1) > 0 ? 1 : -1, out2 = p.dot(e.n2) > 0 ? 1 : -1;
    EXPECT_TRUE(out1 * e.n1.dot(view) < 0 || out2 * e.n2.dot(view) < 0);
  }
}

// r(T exp(xi)) of single observations, through the lens distortion.
TEST(EdgeCue, JacobianAgreesWithDifferences) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const SE3 T = test::boxPose(0.3) * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  const Random random(1, RandomStream::kTest);
  for (int i = 0; i < 40; ++i) {
    const auto u = random.uniform(0, static_cast<uint64_t>(i));
    EdgeObservation o;
    o.sample = static_cast<int>(u[0] * static_cast<double>(model.samples.size()));
    o.u_px = *scene.camera.project(T * model.samples[static_cast<size_t>(o.sample)].p);
    o.normal = Vector2d(std::cos(7 * u[1]), std::sin(7 * u[1]));
    o.candidate_count = 1;
    o.candidates[0].offset_px = 0.2 + u[2];
    std::vector<EdgeObservation> observations = {o};
    constexpr double sigma = 10;  // far above the residual: weight and scale are known
    EdgeCue cue(model, scene.camera, options, observations, sigma);
    const auto residual = [&](const Vector6d& xi) {
      cue.linearise(T * exp(xi));
      return observations[0].residual_px;
    };
    const CueEquations equations = cue.linearise(T);
    const double r = observations[0].residual_px;
    const double weight =
        tukeyWeight(r / sigma, options.tukey_constant) / (sigma * sigma * options.edge_correlation);
    for (int k = 0; k < 6; ++k) {
      constexpr double h = 1e-6;
      const Vector6d xi = h * Vector6d::Unit(k);
      const double numeric = (residual(xi) - residual(-xi)) / (2 * h);
      EXPECT_NEAR(equations.gradient[k] / (weight * r), numeric, 1e-5 * (1 + std::abs(numeric)));
      EXPECT_NEAR(equations.hessian(k, k) / weight, numeric * numeric,
                  1e-4 * (1 + numeric * numeric));
    }
  }
}

TEST(EdgeCue, UnfamiliarCandidatesArePenalisedNotForbidden) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  EdgeObservation o;
  o.u_px = *scene.camera.project(T * model.samples[0].p);
  o.normal = Vector2d(1, 0);
  o.candidate_count = 2;
  o.candidates[0] = {0.5, {}, false};
  o.candidates[1] = {-2.0, {}, true};
  std::vector<EdgeObservation> observations = {o};
  EdgeCue cue(model, scene.camera, options, observations, 1);
  cue.linearise(T);
  EXPECT_EQ(observations[0].chosen, 1);
  observations[0].candidate_count = 1;
  cue.linearise(T);
  EXPECT_EQ(observations[0].chosen, 0);
}

// All edges of the box in an image, with the grey values beside them remembered from another one
// that is `gain` times as bright: the share that looks as remembered.
double familiarAfterGain(double gain, double every_other = 0) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const EdgeSearch search(model, scene.camera, scene.rays, 0, options);
  const SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  const Frame frame = scene.draw(test::boxPose(), 0);
  const std::vector<int> samples = search.visibleSamples(T);
  std::vector<Contrast> memory(model.samples.size());
  for (const EdgeObservation& o : search.search(frame.gray, T, samples, memory, 3)) {
    Contrast& known = memory[static_cast<size_t>(o.sample)] = o.candidates[0].contrast;
    known.before = static_cast<float>(known.before / gain + every_other * (o.sample % 2));
    known.after = static_cast<float>(known.after / gain + every_other * (o.sample % 2));
  }
  int familiar = 0, all = 0;
  for (const EdgeObservation& o : search.search(frame.gray, T, samples, memory, 3))
    familiar += o.candidates[0].like_before, ++all;
  EXPECT_GT(all, 40);
  return familiar / static_cast<double>(all);
}

TEST(EdgeSearch, RememberedContrastFollowsTheLight) {
  EXPECT_EQ(familiarAfterGain(1), 1);
  EXPECT_GT(familiarAfterGain(1.5), 0.9);
  EXPECT_GT(familiarAfterGain(0.6), 0.9);
  EXPECT_LT(familiarAfterGain(1, 60), 0.7);  // half of them look otherwise: that is not the light
}

// However many samples there are, their common displacement is not averaged away.
TEST(EdgeCue, SharedErrorsDoNotShrinkWithTheNumberOfSamples) {
  const test::BoxScene scene;
  const TrackerOptions options;
  const EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  const EdgeSearch search(model, scene.camera, scene.rays, 0, options);
  const SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  const Frame frame = scene.draw(test::boxPose(), 0);
  const auto covariances = [&](int copies) {
    std::vector<EdgeObservation> once = search.search(
        frame.gray, T, search.visibleSamples(T), std::vector<Contrast>(model.samples.size()), 3);
    std::vector<EdgeObservation> all;
    for (int k = 0; k < copies; ++k) all.insert(all.end(), once.begin(), once.end());
    EdgeCue cue(model, scene.camera, options, all, 0.13);
    const CueEquations equations = cue.linearise(T);
    const Matrix6d inverse = equations.hessian.inverse();
    return std::pair(inverse, Matrix6d(inverse * equations.shared * inverse));
  };
  const auto [few, few_shared] = covariances(1);
  const auto [many, many_shared] = covariances(4);
  EXPECT_NEAR(many.trace(), few.trace() / 4, 0.01 * few.trace());
  EXPECT_NEAR(many_shared.trace(), few_shared.trace(), 0.01 * few_shared.trace());
  EXPECT_GT(few_shared.trace(), 0);
}

}  // namespace
}  // namespace diorama
