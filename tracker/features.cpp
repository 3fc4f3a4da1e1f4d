#include "tracker/features.h"

#include <dlib/array2d.h>
#include <dlib/image_keypoint.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/features2d.hpp>

#include "core/errors.h"

namespace diorama {
namespace {

constexpr int kSmallestSide = 16;  // px; below it neither detector has an octave to search

uint8_t toByte(double value) {
  return static_cast<uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

// RootSIFT (Arandjelovic and Zisserman, CVPR 2012): the Euclidean distance of the roots is the
// Hellinger distance of the histograms.
void appendRootSift(const float* descriptor, int size, std::vector<uint8_t>& out) {
  constexpr double kScale = 512;  // the largest entry of a normalised histogram is about a quarter
  double sum = 1e-12;
  for (int i = 0; i < size; ++i) sum += static_cast<double>(descriptor[i]);
  for (int i = 0; i < size; ++i)
    out.push_back(toByte(kScale * std::sqrt(static_cast<double>(descriptor[i]) / sum)));
}

Features extractSift(const Image<uint8_t>& image, int limit) {
  // The default contrast (0.04) leaves a pale label or a blurred print without a point.
  constexpr double kContrast = 0.02, kEdge = 10, kSigma = 1.6;
  // OpenCV's size of a keypoint is its diameter in units of sigma; the descriptor looks at 4 x 4
  // cells of 3 sigma each.
  constexpr double kRadiusPerSize = 3;
  // Its keypoints are those of the image at twice the size, where the centre of pixel u is 2 u +
  // 0.5, divided by two (mended by a flag in OpenCV 4.8).
  const Vector2d shift = Vector2d::Constant(0.25);
  const cv::Mat view(image.height, image.width, CV_8U, const_cast<uint8_t*>(image.pixels.data()));
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  cv::SIFT::create(limit, 3, kContrast, kEdge, kSigma)
      ->detectAndCompute(view, cv::noArray(), points, descriptors);
  // OpenCV keeps all that are as strong as the weakest.
  float weakest = std::numeric_limits<float>::infinity();
  for (const cv::KeyPoint& point : points) weakest = std::min(weakest, point.response);
  int surplus = static_cast<int>(points.size()) - limit;
  Features features;
  for (size_t i = 0; i < points.size(); ++i) {
    if (surplus > 0 && points[i].response <= weakest) {
      --surplus;
      continue;
    }
    features.points.push_back(
        {Vector2d(static_cast<double>(points[i].pt.x), static_cast<double>(points[i].pt.y)) - shift,
         kRadiusPerSize * static_cast<double>(points[i].size)});
    appendRootSift(descriptors.ptr<float>(static_cast<int>(i)), descriptors.cols,
                   features.descriptors);
  }
  return features;
}

Features extractSurf(const Image<uint8_t>& image, int limit) {
  constexpr double kThreshold = 10;  // of the Hessian's determinant
  constexpr double kHalfWidth = 10;  // of the descriptor's window, in scales
  constexpr double kScale = 256;     // entries lie in [-0.5, 0.5], but for rare ones
  dlib::array2d<unsigned char> view(image.height, image.width);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, &view[y][0]);
  Features features;
  for (const dlib::surf_point& point : dlib::get_surf_points(view, limit, kThreshold)) {
    features.points.push_back(
        {Vector2d(point.p.center.x(), point.p.center.y()), kHalfWidth * point.p.scale});
    for (long i = 0; i < point.des.size(); ++i)
      features.descriptors.push_back(toByte(128 + kScale * point.des(i)));
  }
  return features;
}

}  // namespace

std::string toString(FeatureKind kind) { return kind == FeatureKind::kSift ? "sift" : "surf"; }

FeatureKind featureKindFromString(const std::string& name) {
  DIORAMA_CHECK(name == "sift" || name == "surf");
  return name == "sift" ? FeatureKind::kSift : FeatureKind::kSurf;
}

int descriptorSize(FeatureKind kind) { return kind == FeatureKind::kSift ? 128 : 64; }

Features extractFeatures(const Image<uint8_t>& image, FeatureKind kind, int limit) {
  if (image.width < kSmallestSide || image.height < kSmallestSide) return {};
  return kind == FeatureKind::kSift ? extractSift(image, limit) : extractSurf(image, limit);
}

Features extractLargeFeatures(const Image<uint8_t>& image, FeatureKind kind, int limit) {
  Image<uint8_t> half(image.width / 2, image.height / 2);
  for (int y = 0; y < half.height; ++y) {
    const uint8_t *const above = image.row(2 * y), *const below = image.row(2 * y + 1);
    for (int x = 0; x < half.width; ++x)
      half(x, y) = static_cast<uint8_t>(
          (above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1] + 2) >> 2);
  }
  Features features = extractFeatures(half, kind, limit);
  for (Features::Point& point : features.points) {
    point.u_px = 2 * point.u_px + Vector2d(0.5, 0.5);  // the centre of four pixels
    point.radius_px *= 2;
  }
  return features;
}

}  // namespace diorama
