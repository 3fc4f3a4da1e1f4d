// Mip-mapped textures of all materials in one array, 8 bits a channel with gamma 2 (the square root
// of the linear value), so that decoding is one multiplication. Rows run upwards, as v does.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "core/image.h"

namespace diorama {

// Level l has 2^(log_width - l) x 2^(log_height - l) texels; the last level is one texel thin.
struct Texture {
  int base = 0;  // first texel of level 0; the levels follow each other
  int log_width = 0;
  int log_height = 0;
  int lastLevel() const { return log_width < log_height ? log_width : log_height; }
};

class TextureAtlas {
 public:
  TextureAtlas();  // holds a white texture, number 0

  // The number of an sRGB image's texture; the same file is read once. Sizes are resampled to
  // powers of two of at most 4096. Throws MissingInputError or InputError.
  int add(const std::filesystem::path& file);
  int add(const Image<Rgb8>& srgb);

  const Texture& texture(int index) const { return textures_[static_cast<size_t>(index)]; }
  const std::vector<uint32_t>& texels() const { return texels_; }  // r | g << 8 | b << 16

 private:
  std::vector<Texture> textures_;
  std::vector<uint32_t> texels_;
  std::map<std::filesystem::path, int> known_;
};

}  // namespace diorama
