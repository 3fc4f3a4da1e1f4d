#include "tracker/chamfer_maps.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace diorama {
namespace {

constexpr int kWidth = 320;  // cells

cv::Mat fullPicture(const Frame& frame) {
  const Image<uint8_t>& grey = frame.gray;
  if (frame.rgb.width == grey.width && frame.rgb.height == grey.height)
    return {grey.height, grey.width, CV_8UC3, const_cast<Rgb8*>(frame.rgb.pixels.data())};
  return {grey.height, grey.width, CV_8U, const_cast<uint8_t*>(grey.pixels.data())};
}

// Of the channel that changes most, pixel by pixel.
void gradients(const cv::Mat& picture, cv::Mat& dx, cv::Mat& dy) {
  cv::Mat smooth;
  cv::GaussianBlur(picture, smooth, {}, 0.8);
  cv::Sobel(smooth, dx, CV_16S, 1, 0);
  cv::Sobel(smooth, dy, CV_16S, 0, 1);
  const int channels = picture.channels();
  if (channels == 1) return;
  const cv::Mat all_dx = dx, all_dy = dy;
  dx = cv::Mat(picture.rows, picture.cols, CV_16S);
  dy = cv::Mat(picture.rows, picture.cols, CV_16S);
  for (int y = 0; y < picture.rows; ++y) {
    const int16_t *from_x = all_dx.ptr<int16_t>(y), *from_y = all_dy.ptr<int16_t>(y);
    for (int x = 0; x < picture.cols; ++x, from_x += channels, from_y += channels) {
      int best = 0, most = -1;
      for (int c = 0; c < channels; ++c)
        if (const int size = from_x[c] * from_x[c] + from_y[c] * from_y[c]; size > most) {
          best = c;
          most = size;
        }
      dx.at<int16_t>(y, x) = from_x[best];
      dy.at<int16_t>(y, x) = from_y[best];
    }
  }
}

// One picture of the edges for each direction: 0 on an edge, 255 elsewhere.
std::vector<cv::Mat> edgesByDirection(const cv::Mat& picture, const ChamferOptions& options) {
  cv::Mat dx, dy, edges;
  gradients(picture, dx, dy);
  cv::Canny(dx, dy, edges, options.canny_low, options.canny_high, true);
  std::vector<cv::Mat> pictures;
  for (int k = 0; k < ChamferMaps::kDirections; ++k)
    pictures.emplace_back(picture.rows, picture.cols, CV_8U, cv::Scalar(255));
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      if (!edges.at<uint8_t>(y, x)) continue;
      const Vector2d normal(dx.at<int16_t>(y, x), dy.at<int16_t>(y, x));
      pictures[static_cast<size_t>(ChamferMaps::directionOf(normal))].at<uint8_t>(y, x) = 0;
    }
  return pictures;
}

// The distance to an edge of a neighbouring direction may be the shorter one.
void spreadOverDirections(std::array<Image<float>, ChamferMaps::kDirections>& maps, float cost) {
  constexpr int n = ChamferMaps::kDirections;
  const auto relax = [&](int to, int from) {
    const Image<float>& source = maps[static_cast<size_t>((from + n) % n)];
    Image<float>& target = maps[static_cast<size_t>((to + n) % n)];
    for (size_t i = 0; i < target.pixels.size(); ++i)
      target.pixels[i] = std::min(target.pixels[i], source.pixels[i] + cost);
  };
  for (int k = 0; k < 2 * n; ++k) relax(k + 1, k);  // twice around: it is a circle
  for (int k = 2 * n; k > 0; --k) relax(k - 1, k);
}

}  // namespace

int ChamferMaps::directionOf(const Vector2d& normal) {
  const double turns = std::atan2(normal.y(), normal.x()) / std::numbers::pi;  // in [-1, 1]
  return static_cast<int>(std::lround(turns * kDirections) + kDirections) % kDirections;
}

ChamferMaps::ChamferMaps(const Frame& frame, const ChamferOptions& options)
    : cell_(std::max(1, static_cast<int>(std::lround(frame.gray.width / double{kWidth})))),
      farthest_px_(options.farthest_px) {
  const int width = std::max(1, frame.gray.width / cell_),
            height = std::max(1, frame.gray.height / cell_);
  cv::Mat small;
  cv::resize(fullPicture(frame), small, {width, height}, 0, 0, cv::INTER_AREA);
  const std::vector<cv::Mat> edges = edgesByDirection(small, options);
  for (size_t k = 0; k < kDirections; ++k) {
    fine_[k] = Image<float>(width, height);
    cv::Mat distance(height, width, CV_32F, fine_[k].pixels.data());
    cv::distanceTransform(edges[k], distance, cv::DIST_L2, 3, CV_32F);
    distance = cv::min(distance * cell_, farthest_px_);
  }
  spreadOverDirections(fine_, static_cast<float>(options.direction_cost_px));
  mean_ = Image<float>(width, height);
  for (const Image<float>& map : fine_)
    for (size_t i = 0; i < map.pixels.size(); ++i) mean_.pixels[i] += map.pixels[i] / kDirections;
  coarse_width_ = width / kCoarse;
  coarse_height_ = height / kCoarse;
  for (size_t k = 0; k < kDirections; ++k) coarse_[k] = ratios(fine_[k]);
}

Image<uint8_t> ChamferMaps::ratios(const Image<float>& map) const {
  Image<uint8_t> out(coarse_width_ + 2 * kBorder + kBlock, coarse_height_ + 2 * kBorder, kChance);
  for (int y = 0; y < coarse_height_; ++y)
    for (int x = 0; x < coarse_width_; ++x) {
      const int fx = kCoarse * x + kCoarse / 2, fy = kCoarse * y + kCoarse / 2;
      // A distance below a pixel is as good as none.
      const double ratio =
          static_cast<double>(map(fx, fy)) / (1 + static_cast<double>(mean_(fx, fy)));
      out(x + kBorder, y + kBorder) =
          static_cast<uint8_t>(std::min(255L, std::lround(kChance * ratio)));
    }
  return out;
}

double ChamferMaps::at(const Image<float>& map, double x, double y) const {
  if (!(x >= 0 && y >= 0 && x < map.width - 1 && y < map.height - 1)) return farthest_px_;
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const double a = x - xi, b = y - yi;
  const float* p = map.row(yi) + xi;
  const float* q = p + map.width;
  const double top = (1 - a) * static_cast<double>(p[0]) + a * static_cast<double>(p[1]);
  const double bottom = (1 - a) * static_cast<double>(q[0]) + a * static_cast<double>(q[1]);
  return (1 - b) * top + b * bottom;
}

double ChamferMaps::meanDistance(const Vector2d& u_px) const {
  return at(mean_, (u_px.x() + 0.5) / cell_ - 0.5, (u_px.y() + 0.5) / cell_ - 0.5);
}

ChamferMaps::Sample ChamferMaps::sample(const Vector2d& u_px, int direction) const {
  const Image<float>& map = fine_[static_cast<size_t>(direction)];
  // The centre of cell 0 is the mean of its pixels' centres.
  const double x = (u_px.x() + 0.5) / cell_ - 0.5, y = (u_px.y() + 0.5) / cell_ - 0.5;
  return {at(map, x, y),
          Vector2d(at(map, x + 1, y) - at(map, x - 1, y), at(map, x, y + 1) - at(map, x, y - 1)) /
              (2.0 * cell_)};
}

}  // namespace diorama
