// Shapes, cameras and measurements that the tests of both renderers share.
#pragma once

#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/camera.h"
#include "sim/renderer.h"
#include "tests/sim/scene_support.h"

namespace diorama::test {

inline const CameraParameters kDistorted = {
    CameraModel::kRadTan, 160, 120, 130, 131, 78.3, 60.1, {-0.11, 0.045, 0.0006, -0.0004}};

// A sphere of latitudes and longitudes around the origin.
inline std::string sphere(double radius, int rings) {
  std::string text;
  const int sectors = 2 * rings;
  for (int r = 0; r <= rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const double a = M_PI * r / rings, b = 2 * M_PI * s / sectors;
      char line[120];
      std::snprintf(line, sizeof line, "v %.9f %.9f %.9f\n", radius * std::sin(a) * std::cos(b),
                    radius * std::sin(a) * std::sin(b), radius * std::cos(a));
      text += line;
    }
  for (int r = 0; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) {
      const int a = r * sectors + s + 1, b = r * sectors + (s + 1) % sectors + 1;
      const auto face = [&](int i, int j, int k) {
        text += "f " + std::to_string(i) + ' ' + std::to_string(j) + ' ' + std::to_string(k) + '\n';
      };
      if (r > 0) face(a, b + sectors, b);
      if (r < rings - 1) face(a, a + sectors, b + sectors);
    }
  return text;
}

// Four quadrants, black and white, that meet in the middle of a texture.
inline std::filesystem::path writeCheckerboard(const Workshop& workshop) {
  cv::Mat board(512, 512, CV_8UC3, cv::Scalar(230, 230, 230));
  board(cv::Rect(0, 0, 256, 256)).setTo(cv::Scalar(20, 20, 20));
  board(cv::Rect(256, 256, 256, 256)).setTo(cv::Scalar(20, 20, 20));
  const std::filesystem::path file = workshop.folder() / "board.png";
  cv::imwrite(file.string(), board);
  workshop.write("board.mtl", "newmtl paint\nKd 1 1 1\nKs 0 0 0\nmap_Kd board.png\n");
  return workshop.write("board.obj", square(0.5, "mtllib board.mtl\n"));
}

// The linear radiance as a grey image with the curve of a display.
inline cv::Mat grey(const Image<Radiance>& radiance) {
  cv::Mat image(radiance.height, radiance.width, CV_32F);
  float most = 0;
  for (const Radiance& p : radiance.pixels) most = std::max(most, p.g);
  for (int y = 0; y < radiance.height; ++y)
    for (int x = 0; x < radiance.width; ++x) image.at<float>(y, x) = 255 * radiance(x, y).g / most;
  return image;
}

// Where the checkerboard's corner near a pixel is seen.
inline Vector2d refinedCorner(const Image<Radiance>& radiance, const Vector2d& near_px) {
  std::vector<cv::Point2f> corner = {cv::Point2f(static_cast<float>(std::round(near_px.x())),
                                                 static_cast<float>(std::round(near_px.y())))};
  // On an ideal corner, as sharp as pixels allow, cornerSubPix itself errs by up to 0.08 px;
  // blurred by 2 px, which moves no corner, by 0.012 px.
  cv::Mat image = grey(radiance);
  cv::GaussianBlur(image, image, cv::Size(), 2);
  cv::cornerSubPix(image, corner, cv::Size(8, 8), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4));
  return {static_cast<double>(corner[0].x), static_cast<double>(corner[0].y)};
}

}  // namespace diorama::test
