// Images from files, checked before they are decoded.
#pragma once

#include <filesystem>
#include <variant>

#include "core/camera.h"
#include "core/frame.h"
#include "core/image.h"

namespace diorama {

using AnyImage = std::variant<Image<Rgb8>, Image<uint8_t>, Image<uint16_t>>;

// A colour or grey image of any format that OpenCV reads. Alpha is dropped; colour of 16 bits is
// rounded to 8, grey keeps its depth. Throws MissingInputError, or InputError when the file is
// broken (cut short, wrong checksum, not an image) or its size is not width x height.
AnyImage readImage(const std::filesystem::path& file, int width, int height);

// Colour of 16 bits as it is, such as KITTI's flow. Throws as readImage().
Image<Rgb16> readWideColor(const std::filesystem::path& file, int width, int height);

struct ImageSize {
  int width = 0, height = 0;  // px
};
// Throws as readImage().
ImageSize imageSize(const std::filesystem::path& file);

// The picture of a frame, grey or colour; 16 bits of grey are rounded to 8. Throws as readImage().
Frame readFrame(const std::filesystem::path& file, const Camera& camera);

}  // namespace diorama
