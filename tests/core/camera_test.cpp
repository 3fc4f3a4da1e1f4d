// The camera models against OpenCV's, and their Jacobians.
#include "core/camera.h"

#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/calib3d.hpp>

#include "tests/support/matchers.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

CameraParameters parameters(CameraModel model, std::vector<double> distortion) {
  CameraParameters p;
  p.model = model;
  p.fx = 521.3;
  p.fy = 517.9;
  p.cx = 318.7;
  p.cy = 241.2;
  p.distortion = std::move(distortion);
  return p;
}

std::vector<CameraParameters> cameras() {
  return {parameters(CameraModel::kPinhole, {}),
          parameters(CameraModel::kRadTan, {}),
          parameters(CameraModel::kRadTan, {0, 0, 0, 0}),
          parameters(CameraModel::kRadTan, {-0.12, 0.05, 0.0011, -0.0007}),
          parameters(CameraModel::kRadTan, {0.26, -0.95, -0.0054, 0.0026, 1.16}),
          parameters(CameraModel::kRadTan, {0.4, 0.1, 0.001, -0.002, 0.02, 0.7, 0.2, 0.05}),
          parameters(CameraModel::kFisheye, {}),
          parameters(CameraModel::kFisheye, {0.02, -0.01, 0.004, -0.001})};
}

cv::Mat matrixOf(const CameraParameters& p) {
  return (cv::Mat_<double>(3, 3) << p.fx, 0, p.cx, 0, p.fy, p.cy, 0, 0, 1);
}

// Pixels by OpenCV.
std::vector<cv::Point2d> project(const CameraParameters& p, const std::vector<Vector3d>& points) {
  std::vector<cv::Point3d> input;
  for (const Vector3d& point : points) input.emplace_back(point.x(), point.y(), point.z());
  std::vector<cv::Point2d> pixels;
  std::vector<double> k = p.distortion;
  const cv::Vec3d zero(0, 0, 0);
  if (p.model == CameraModel::kFisheye) {
    k.resize(4, 0);
    cv::fisheye::projectPoints(input, pixels, zero, zero, matrixOf(p), k);
  } else {
    cv::projectPoints(input, zero, zero, matrixOf(p), k, pixels);
  }
  return pixels;
}

// Points whose pixels fill the image and a margin around it.
std::vector<Vector3d> points(double reach = 0.7) {
  Numbers numbers(1);
  std::vector<Vector3d> all{{0, 0, 1}, {1e-10, 0, 1}, {0, -1e-7, 2}};
  for (int i = 0; i < 300; ++i) {
    const double z = numbers.uniform(0.1, 10);
    all.emplace_back(z * numbers.uniform(-reach, reach), z * numbers.uniform(-0.5, 0.5), z);
  }
  return all;
}

TEST(Camera, ProjectsLikeOpenCv) {
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    const std::vector<Vector3d> all = points();
    const std::vector<cv::Point2d> expected = project(p, all);
    int compared = 0;
    for (size_t i = 0; i < all.size(); ++i) {
      const std::optional<Vector2d> u = camera.project(all[i]);
      if (!u) continue;  // beyond the radius; tested below
      ++compared;
      EXPECT_NEAR(u->x(), expected[i].x, 1e-6) << toString(p.model) << p.distortion.size();
      EXPECT_NEAR(u->y(), expected[i].y, 1e-6);
    }
    EXPECT_GT(compared, 250) << toString(p.model) << p.distortion.size();
  }
}

TEST(Camera, UnprojectsLikeOpenCv) {
  const cv::TermCriteria precise(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-14);
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    for (int y = 0; y < 480; y += 37) {
      for (int x = 0; x < 640; x += 41) {
        const std::vector<cv::Point2d> pixel{cv::Point2d(x, y)};
        std::vector<cv::Point2d> expected;
        std::vector<double> k = p.distortion;
        if (p.model == CameraModel::kFisheye) {
          k.resize(4, 0);
          cv::fisheye::undistortPoints(pixel, expected, matrixOf(p), k);
        } else {
          cv::undistortPoints(pixel, expected, matrixOf(p), k, cv::noArray(), cv::noArray(),
                              precise);
        }
        const std::optional<Vector3d> ray = camera.unproject(Vector2d(x, y));
        ASSERT_TRUE(ray) << toString(p.model) << p.distortion.size() << " " << x << " " << y;
        EXPECT_EQ(ray->z(), 1);
        // In pixels. OpenCV's iteration for fisheye stops at 1e-8 rad.
        const double tolerance = p.model == CameraModel::kFisheye ? 2e-5 : 1e-6;
        EXPECT_NEAR(ray->x() * p.fx, expected[0].x * p.fx, tolerance)
            << toString(p.model) << p.distortion.size() << " " << x << " " << y;
        EXPECT_NEAR(ray->y() * p.fy, expected[0].y * p.fy, tolerance);
      }
    }
  }
}

TEST(Camera, UnprojectUndoesProject) {
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    for (const Vector3d& point : points()) {
      const std::optional<Vector2d> u = camera.project(point);
      if (!u) continue;
      const std::optional<Vector3d> ray = camera.unproject(*u);
      ASSERT_TRUE(ray) << toString(p.model) << p.distortion.size() << " " << point.transpose();
      EXPECT_THAT(*ray, MatrixNear(Vector3d(point / point.z()), 1e-9));
    }
  }
}

TEST(Camera, JacobiansMatchNumericOnes) {
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    for (const Vector3d& point : points(0.55)) {
      const auto projection = camera.projectWithJacobian(point);
      if (!projection) continue;
      EXPECT_THAT(projection->u_px, MatrixNear(*camera.project(point), 1e-10));
      // Scaled to a point at unit depth, where the entries are of the size of fx.
      const Eigen::MatrixXd J = numericJacobian(
          [&](const Vector3d& x) { return Eigen::VectorXd(camera.project(point.z() * x).value()); },
          Vector3d(point / point.z()));
      EXPECT_THAT(projection->J * point.z(), MatrixNear(J, 2e-5))
          << toString(p.model) << p.distortion.size() << " " << point.transpose();
    }
  }
}

TEST(Camera, PointsThatAreNotInFrontHaveNoPixel) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    for (const Vector3d& point :
         {Vector3d(0, 0, 0), Vector3d(0, 0, -1), Vector3d(0.1, 0, -1), Vector3d(nan, 0, 1),
          Vector3d(0, 0, nan), Vector3d(1, 0, 1e-12)}) {
      EXPECT_FALSE(camera.project(point)) << point.transpose();
      EXPECT_FALSE(camera.projectWithJacobian(point)) << point.transpose();
    }
  }
}

// k1 = -0.3: the distorted radius r (1 - 0.3 r^2) falls from r = 1 / sqrt(0.9) on.
TEST(Camera, PointsBeyondTheOneToOneRadiusHaveNoPixel) {
  const Camera camera(parameters(CameraModel::kRadTan, {-0.3, 0, 0, 0}));
  const double turning = 1 / std::sqrt(0.9);
  EXPECT_TRUE(camera.project({0.99 * turning, 0, 1}));
  EXPECT_FALSE(camera.project({1.01 * turning, 0, 1}));
  EXPECT_FALSE(camera.project({0, -5, 1}));
  EXPECT_FALSE(camera.projectWithJacobian({0, -5, 1}));
  // Pixels farther out than any point's.
  const double largest = turning * (1 - 0.3 * turning * turning);
  EXPECT_TRUE(camera.unproject({camera.parameters().cx + 0.98 * largest * camera.fx(), 241.2}));
  EXPECT_FALSE(camera.unproject({camera.parameters().cx + 1.02 * largest * camera.fx(), 241.2}));
}

TEST(Camera, UnprojectOfStrangePixelsEndsWithNothingOrAFiniteRay) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const CameraParameters& p : cameras()) {
    const Camera camera(p);
    for (const Vector2d& u :
         {Vector2d(1e9, 0), Vector2d(-1e300, 1e300), Vector2d(5000, -4000), Vector2d(nan, 0),
          Vector2d(0, std::numeric_limits<double>::infinity())}) {
      const std::optional<Vector3d> ray = camera.unproject(u);
      EXPECT_TRUE(!ray || ray->allFinite()) << toString(p.model) << " " << u.transpose();
    }
  }
}

TEST(Camera, PixelZeroIsACentre) {
  const Camera camera;
  EXPECT_TRUE(camera.contains({-0.5, -0.5}));
  EXPECT_TRUE(camera.contains({639.5, 479.5}));
  EXPECT_FALSE(camera.contains({639.6, 10}));
  EXPECT_FALSE(camera.contains({10, -0.51}));
  EXPECT_TRUE(camera.contains({1.5, 1.5}, 2));
  EXPECT_FALSE(camera.contains({1.4, 5}, 2));
}

TEST(Camera, ProblemsOfParametersAreNamed) {
  EXPECT_FALSE(CameraParameters{}.problem());
  const auto problem = [](auto change) {
    CameraParameters p;
    change(p);
    return p.problem().has_value();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(problem([](auto& p) { p.width = 0; }));
  EXPECT_TRUE(problem([](auto& p) { p.height = -1; }));
  EXPECT_TRUE(problem([](auto& p) { p.width = 1 << 20; }));
  EXPECT_TRUE(problem([](auto& p) { p.fx = 0; }));
  EXPECT_TRUE(problem([&](auto& p) { p.fy = nan; }));
  EXPECT_TRUE(problem([&](auto& p) { p.cx = nan; }));
  EXPECT_TRUE(problem([](auto& p) { p.distortion = {0.1, 0, 0, 0}; }));  // a pinhole
  EXPECT_TRUE(problem([](auto& p) { p.model = CameraModel::kRadTan, p.distortion = {1, 2, 3}; }));
  EXPECT_TRUE(problem([](auto& p) {
    p.model = CameraModel::kFisheye, p.distortion = {0, 0, 0, 0, 0};
  }));
  EXPECT_TRUE(problem([&](auto& p) {
    p.model = CameraModel::kRadTan, p.distortion = {nan, 0, 0, 0};
  }));
}

TEST(Camera, ModelsHaveNames) {
  for (CameraModel model : {CameraModel::kPinhole, CameraModel::kRadTan, CameraModel::kFisheye})
    EXPECT_EQ(cameraModelFromString(toString(model)), model);
  EXPECT_FALSE(cameraModelFromString("brown"));
}

}  // namespace
}  // namespace diorama
