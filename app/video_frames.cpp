#include "app/video_frames.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace diorama {
namespace {

std::string asJpeg(const cv::Mat& picture, const VideoFrameOptions& options) {
  cv::Mat small;
  const int height = std::max(1, picture.rows * options.width / std::max(1, picture.cols));
  cv::resize(picture, small, {options.width, height}, 0, 0, cv::INTER_AREA);
  std::vector<uchar> bytes;
  cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, options.jpeg_quality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::vector<std::string> videoFrames(const std::filesystem::path& video,
                                     const std::vector<size_t>& positions,
                                     const VideoFrameOptions& options) {
  std::vector<std::string> pictures(positions.size());
  std::error_code error;
  if (positions.empty() || !std::filesystem::exists(video, error)) return pictures;
  cv::VideoCapture reader(video.string(), cv::CAP_FFMPEG);
  const size_t last = *std::max_element(positions.begin(), positions.end());
  cv::Mat picture;
  // Frame by frame: to jump goes wrong by some frames with many codecs.
  for (size_t i = 0; i <= last && reader.grab(); ++i)
    for (size_t k = 0; k < positions.size(); ++k)
      if (positions[k] == i && reader.retrieve(picture)) pictures[k] = asJpeg(picture, options);
  return pictures;
}

}  // namespace diorama
