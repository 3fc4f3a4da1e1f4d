// H.264 video (avc1, which browsers play), encoded on a thread of its own.
#pragma once

#include <filesystem>
#include <memory>

#include "core/image.h"

namespace diorama {

class VideoWriter {
 public:
  // Throws OutputError when the file or the codec cannot be opened.
  VideoWriter(std::filesystem::path file, int width, int height, double rate_hz);
  ~VideoWriter();  // without finish() nothing is left behind

  // Waits while the encoder is far behind.
  void add(Image<Rgb8> picture);

  // Waits until everything is written and gives the file its final name; throws OutputError.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace diorama
