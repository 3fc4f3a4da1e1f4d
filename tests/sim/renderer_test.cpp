// The ray renderer against geometry that is known exactly.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sim/ray_renderer.h"
#include "tests/sim/lit_scene.h"
#include "tests/sim/scene_support.h"
#include "tests/sim/test_pictures.h"

namespace diorama {
namespace {

using test::kDistorted;
using test::lit;
using test::object;
using test::plainScene;
using test::refinedCorner;
using test::sphere;
using test::square;
using test::Workshop;
using test::writeCheckerboard;

RenderedFrame renderStill(const Scene& scene, RenderQuality quality = RenderQuality::kDraft,
                          int threads = 1) {
  const RayRenderer renderer(lit(scene), Camera(scene.camera), {quality, threads});
  const SE3 pose = scene.path->pose(0);
  return renderer.render({.T_world_camera = [&](double) { return pose; }});
}

TEST(RayRenderer, DepthOfAPlane) {
  const Workshop workshop("plane");
  Scene scene = plainScene();
  scene.objects = {object("plane", workshop.write("p.obj", square(6)), Vector3d(1.3, 0, 0))};
  scene.objects[0].T_world_object.rotation =
      Eigen::AngleAxisd(0.7, Vector3d(0.1, 0.3, 1).normalized());
  for (const CameraParameters& camera : {scene.camera, kDistorted}) {
    scene.camera = camera;
    const RenderedFrame frame = renderStill(scene);
    const SE3 T_camera_object = scene.path->pose(0).inverse() * scene.objects[0].T_world_object;
    const Vector3d n = T_camera_object.rotationMatrix().col(0), p = T_camera_object.translation;
    const Camera model(camera);
    int checked = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const Vector3d d = *model.unproject(Vector2d(x, y));
        const double z = n.dot(p) / n.dot(d);
        if (frame.depth_m(x, y) == 0) continue;
        ASSERT_NEAR(static_cast<double>(frame.depth_m(x, y)), z, 1e-5) << x << ' ' << y;
        ++checked;
      }
    EXPECT_GT(checked, 15000);
  }
}

TEST(RayRenderer, DepthOfASphere) {
  // A ring of radius 0.1 m in steps of pi / 200 departs from its circle by 0.1 (pi / 200)^2 / 8 =
  // 3e-6, a facet by twice that.
  const Workshop workshop("sphere");
  const double radius = 0.1;
  Scene scene = plainScene();
  scene.camera.fx = scene.camera.fy = 400;
  scene.objects = {
      object("ball", workshop.write("s.obj", sphere(radius, 200)), Vector3d(1, 0.02, 0.01))};
  const RenderedFrame frame = renderStill(scene);
  const Vector3d center = scene.path->pose(0).inverse() * Vector3d(1, 0.02, 0.01);
  const Camera model(scene.camera);
  int checked = 0;
  for (int y = 0; y < scene.camera.height; ++y)
    for (int x = 0; x < scene.camera.width; ++x) {
      const Vector3d d = *model.unproject(Vector2d(x, y));
      const double a = d.squaredNorm(), b = d.dot(center),
                   c = center.squaredNorm() - radius * radius;
      const double root = b * b - a * c;
      const Vector3d closest = d * (b / a) - center;
      if (closest.norm() > 0.75 * radius)
        continue;  // near the limb the facets' departure counts several times in depth
      ASSERT_NEAR(static_cast<double>(frame.depth_m(x, y)), (b - std::sqrt(root)) / a, 1e-5);
      ++checked;
    }
  EXPECT_GT(checked, 2500);
}

TEST(RayRenderer, CheckerboardCornerLiesWhereTheCameraProjectsIt) {
  const Workshop workshop("corner");
  const std::filesystem::path board = writeCheckerboard(workshop);
  const CameraParameters pinhole = {CameraModel::kPinhole, 640, 480, 520, 520, 319.5, 239.5, {}};
  const CameraParameters distorted = {CameraModel::kRadTan, 640, 480, 522.7, 523.4, 318.6, 243.1,
                                      kDistorted.distortion};
  for (const CameraParameters& parameters : {pinhole, distorted})
    for (const auto& [right, up] :
         {std::pair(0.0, 0.0), {0.113, 0.057}, {-0.31, 0.22}, {0.237, -0.249}}) {
      Scene scene = plainScene();
      scene.camera = parameters;
      scene.objects = {object("board", board, Vector3d(1, -right, up))};
      const RenderedFrame frame = renderStill(scene, RenderQuality::kHigh);
      const Vector2d expected = *Camera(parameters).project(Vector3d(right, -up, 1));
      const Vector2d found = refinedCorner(frame.radiance, expected);
      EXPECT_NEAR(found.x(), expected.x(), 0.02);
      EXPECT_NEAR(found.y(), expected.y(), 0.02);
    }
}

TEST(RayRenderer, TextureStandsUpright) {
  const Workshop workshop("upright");
  cv::Mat picture(64, 64, CV_8UC3, cv::Scalar(0, 0, 0));          // BGR
  picture(cv::Rect(0, 0, 32, 32)).setTo(cv::Scalar(0, 0, 255));   // top left: red
  picture(cv::Rect(32, 0, 32, 32)).setTo(cv::Scalar(0, 255, 0));  // top right: green
  picture(cv::Rect(0, 32, 32, 32)).setTo(cv::Scalar(255, 0, 0));  // bottom left: blue
  cv::imwrite((workshop.folder() / "q.png").string(), picture);
  workshop.write("q.mtl", "newmtl paint\nKd 1 1 1\nKs 0 0 0\nmap_Kd q.png\n");
  Scene scene = plainScene();
  scene.objects = {
      object("q", workshop.write("q.obj", square(0.6, "mtllib q.mtl\n")), Vector3d(1, 0, 0))};
  const Image<Radiance> picture_seen = renderStill(scene).radiance;
  const Radiance red = picture_seen(65, 45), green = picture_seen(94, 45),
                 blue = picture_seen(65, 74);
  EXPECT_GT(red.r, 10 * std::max(red.g, red.b));
  EXPECT_GT(green.g, 10 * std::max(green.r, green.b));
  EXPECT_GT(blue.b, 10 * std::max(blue.r, blue.g));
}

TEST(RayRenderer, FarTexturesAreAveraged) {
  // A fine checkerboard far away is an even grey: mip levels, and their mean is that of linear
  // light.
  const Workshop workshop("mip");
  cv::Mat board(256, 256, CV_8UC3);
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x)
      board.at<cv::Vec3b>(y, x) = (x + y) % 2 ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
  cv::imwrite((workshop.folder() / "c.png").string(), board);
  workshop.write("c.mtl", "newmtl paint\nKd 1 1 1\nKs 0 0 0\nmap_Kd c.png\n");
  Scene scene = plainScene();
  scene.objects = {
      object("c", workshop.write("c.obj", square(0.5, "mtllib c.mtl\n")), Vector3d(1.5, 0, 0))};
  for (const RenderQuality quality : {RenderQuality::kDraft, RenderQuality::kStandard}) {
    const Image<Radiance> picture = renderStill(scene, quality).radiance;
    for (int y = 50; y < 70; ++y)
      for (int x = 70; x < 90; ++x) ASSERT_NEAR(picture(x, y).g, 0.5f, 0.02f);  // sky of radiance 1
  }
}

TEST(RayRenderer, SilhouettesAndMasks) {
  // A small square hides the left half of a larger one, and a third leaves the image.
  const Workshop workshop("masks");
  const std::filesystem::path file = workshop.write("p.obj", square(0.2));
  Scene scene = plainScene();
  scene.objects = {object("back", file, Vector3d(1, 0, 0)),
                   object("front", file, Vector3d(0.5, 0.05, 0)),
                   object("out", file, Vector3d(1, 0.62, 0))};
  scene.objects[1].scale = 0.5;
  const RenderedFrame frame = renderStill(scene);
  ASSERT_EQ(frame.silhouettes.size(), 3u);
  const Silhouette &back = frame.silhouettes[0], &front = frame.silhouettes[1],
                   &out = frame.silhouettes[2];
  EXPECT_EQ(back.px_all, 26 * 26);  // 0.2 m at 1 m and 130 px
  EXPECT_EQ(back.px_valid, 26 * 26);
  EXPECT_EQ(back.px_visible, 13 * 26);
  EXPECT_EQ(front.px_visible, 26 * 26);
  EXPECT_EQ(out.px_all, 26 * 26);  // its centre lies 1.1 px beside the border
  EXPECT_LT(out.px_valid, 14 * 26);
  EXPECT_GT(out.px_valid, 10 * 26);
  EXPECT_EQ(out.px_visible, out.px_valid);
  int seen[4] = {};
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const int id = frame.instance_id(x, y);
      ASSERT_LE(id, 3);
      ++seen[id];
      EXPECT_EQ(frame.depth_m(x, y) > 0, id > 0);
      if (id == 0) continue;
      EXPECT_EQ(frame.silhouettes[static_cast<size_t>(id - 1)].mask(x, y), 255);
    }
  EXPECT_EQ(seen[1], back.px_visible);
  EXPECT_EQ(seen[2], front.px_visible);
  EXPECT_EQ(seen[3], out.px_visible);
}

TEST(RayRenderer, WhatStandsBehindABallDoesNotShowThroughItsRim) {
  // Near the limb its facets are narrower than a pixel, and no pixel's centre meets them.
  const Workshop workshop("rim");
  const double radius = 0.1;
  Scene scene = plainScene();
  scene.camera.fx = scene.camera.fy = 400;
  const Vector3d center(1, 0.003, 0.002);
  workshop.write("black.mtl", "newmtl paint\nKd 0 0 0\nKs 0 0 0\n");
  scene.objects = {
      object("ball", workshop.write("s.obj", sphere(radius, 60)), center),
      object("wall", workshop.write("p.obj", square(6, "mtllib black.mtl\n")), Vector3d(3, 0, 0))};
  const Image<Radiance> picture = renderStill(scene, RenderQuality::kStandard).radiance;
  const Vector3d p = scene.path->pose(0).inverse() * center;
  const Camera model(scene.camera);
  const double limb_rad = std::asin(radius / p.norm()), pixel_rad = 1 / scene.camera.fx;
  int checked = 0;
  for (int y = 0; y < scene.camera.height; ++y)
    for (int x = 0; x < scene.camera.width; ++x) {
      const double angle =
          std::acos(model.unproject(Vector2d(x, y))->normalized().dot(p) / p.norm());
      if (angle > limb_rad - pixel_rad || angle < limb_rad - 4 * pixel_rad) continue;
      ASSERT_GT(picture(x, y).g, 0.3f) << x << ' ' << y;
      ++checked;
    }
  EXPECT_GT(checked, 500);
}

TEST(RayRenderer, BlurIsTheMeanOfSharpFrames) {
  const Workshop workshop("blur");
  Scene scene = plainScene();
  scene.objects = {object("board", writeCheckerboard(workshop), Vector3d(1, 0, 0))};
  const RayRenderer renderer(lit(scene), Camera(scene.camera), {RenderQuality::kHigh, 1});
  const SE3 start = scene.path->pose(0);
  const auto at = [&](double time_s) {  // in one second 5 px to the right, 2 px upwards
    SE3 pose = start;
    pose.translation += Vector3d(0, -5.0 / 130, 2.0 / 130) * time_s;
    return pose;
  };
  const Image<Radiance> blurred = renderer.render({.T_world_camera = at, .exposure_s = 1}).radiance;
  std::vector<double> mean(blurred.pixels.size());
  constexpr int kFrames = 64;
  for (int k = 0; k < kFrames; ++k) {
    const SE3 pose = at((k + 0.5) / kFrames - 0.5);
    const auto sharp = renderer.render({.T_world_camera = [&](double) { return pose; }});
    for (size_t i = 0; i < mean.size(); ++i)
      mean[i] += static_cast<double>(sharp.radiance.pixels[i].g) / kFrames;
  }
  double bias = 0, square_sum = 0;
  for (size_t i = 0; i < mean.size(); ++i) {
    const double d = static_cast<double>(blurred.pixels[i].g) - mean[i];
    bias += d / static_cast<double>(mean.size());
    square_sum += d * d / static_cast<double>(mean.size());
  }
  EXPECT_LT(std::abs(bias), 1.0 / 255);  // white is 1
  EXPECT_LT(std::sqrt(square_sum), 4.0 / 255);
}

TEST(RayRenderer, ThreadsDoNotChangeThePicture) {
  const Workshop workshop("threads");
  Scene scene = plainScene();
  scene.camera.width = 161;  // no whole number of tiles or packets
  scene.camera.height = 97;
  scene.objects = {object("board", writeCheckerboard(workshop), Vector3d(1, 0, 0)),
                   object("ball", workshop.write("s.obj", sphere(0.1, 20)), Vector3d(0.7, 0.1, 0))};
  const RenderedFrame one = renderStill(scene, RenderQuality::kStandard, 1),
                      two = renderStill(scene, RenderQuality::kStandard, 2);
  EXPECT_EQ(one.radiance, two.radiance);
  EXPECT_EQ(one.depth_m, two.depth_m);
  EXPECT_EQ(one.instance_id, two.instance_id);
  EXPECT_EQ(one.silhouettes[1].mask, two.silhouettes[1].mask);
  EXPECT_EQ(one.silhouettes[1].px_all, two.silhouettes[1].px_all);
}

}  // namespace
}  // namespace diorama
