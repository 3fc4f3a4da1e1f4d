// How the files of a sequence are called.
#pragma once

#include <cstddef>
#include <string>

namespace diorama {

// A frame's number or an object's index with six digits.
inline std::string sixDigits(size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(digits.size() < 6 ? 6 - digits.size() : 0, '0') + digits;
}

inline std::string frameFile(const std::string& channel, int frame) {
  return channel + "/" + sixDigits(static_cast<size_t>(frame)) + ".png";
}

// `channel` is mask or mask_visib, `object` the index in sequence.yaml.
inline std::string maskFile(const std::string& channel, int frame, size_t object) {
  return channel + "/" + sixDigits(static_cast<size_t>(frame)) + "_" + sixDigits(object) + ".png";
}

}  // namespace diorama
