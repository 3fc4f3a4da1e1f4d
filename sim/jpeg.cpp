#include "sim/jpeg.h"

#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/errors.h"

namespace diorama {

Image<Rgb8> throughJpeg(const Image<Rgb8>& picture, int quality) {
  cv::Mat bgr(picture.height, picture.width, CV_8UC3);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const Rgb8& p = picture(x, y);
      bgr.at<cv::Vec3b>(y, x) = {p.b, p.g, p.r};
    }
  std::vector<uint8_t> coded;
  DIORAMA_CHECK(cv::imencode(".jpg", bgr, coded, {cv::IMWRITE_JPEG_QUALITY, quality}));
  const cv::Mat decoded = cv::imdecode(coded, cv::IMREAD_COLOR);
  Image<Rgb8> result(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      const cv::Vec3b& p = decoded.at<cv::Vec3b>(y, x);
      result(x, y) = {p[2], p[1], p[0]};
    }
  return result;
}

}  // namespace diorama
