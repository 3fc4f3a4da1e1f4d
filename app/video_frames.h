// Single pictures of a video.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace diorama {

struct VideoFrameOptions {
  int width = 400;  // px; the height follows
  int jpeg_quality = 78;
};

// JPEG bytes of the frames at these positions (any order); empty ones where the video is missing or
// shorter.
std::vector<std::string> videoFrames(const std::filesystem::path& video,
                                     const std::vector<size_t>& positions,
                                     const VideoFrameOptions& options);

}  // namespace diorama
