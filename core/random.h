// Counter-based random numbers (Philox 4x32-10, Salmon et al. 2011): a value is a function of
// (seed, stream, frame, index), so that the same seed gives the same numbers for any number of
// threads.
#pragma once

#include <Random123/philox.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace diorama {

// Each use of randomness has a stream of its own.
enum class RandomStream : uint32_t {
  kSensorNoise = 1,
  kLight,
  kPixel,
  kOdometry,
  kTracker,
  kPath,
  kTest,
  kImu,
  kDetector,
  kParticles
};

class Random {
 public:
  Random(uint64_t seed, RandomStream stream)
      : key_{{static_cast<uint32_t>(seed), static_cast<uint32_t>(seed >> 32)}},
        stream_(static_cast<uint32_t>(stream)) {}

  std::array<uint32_t, 4> bits(uint32_t frame, uint64_t index) const {
    const r123::Philox4x32::ctr_type counter{
        {static_cast<uint32_t>(index), static_cast<uint32_t>(index >> 32), frame, stream_}};
    const r123::Philox4x32::ctr_type out = r123::Philox4x32()(counter, key_);
    return {out[0], out[1], out[2], out[3]};
  }

  // Word w of the draws `first` to `first` + 7, as of bits(), in [w][0] to [w][7]: plain loops over
  // eight lanes, which compilers turn into vectors.
  std::array<std::array<uint32_t, 8>, 4> bitsOfEight(uint32_t frame, uint64_t first) const {
    std::array<std::array<uint32_t, 8>, 4> c{};
    for (size_t k = 0; k < 8; ++k) {
      c[0][k] = static_cast<uint32_t>(first + k);
      c[1][k] = static_cast<uint32_t>((first + k) >> 32);
    }
    c[2].fill(frame);
    c[3].fill(stream_);
    uint32_t key0 = key_[0], key1 = key_[1];
    for (int round = 0; round < 10; ++round, key0 += 0x9E3779B9u, key1 += 0xBB67AE85u)
      for (size_t k = 0; k < 8; ++k) {
        const uint64_t p0 = uint64_t{0xD2511F53u} * c[0][k], p1 = uint64_t{0xCD9E8D57u} * c[2][k];
        c[0][k] = static_cast<uint32_t>(p1 >> 32) ^ c[1][k] ^ key0;
        c[1][k] = static_cast<uint32_t>(p1);
        c[2][k] = static_cast<uint32_t>(p0 >> 32) ^ c[3][k] ^ key1;
        c[3][k] = static_cast<uint32_t>(p0);
      }
    return c;
  }

  // Four numbers in (0, 1).
  std::array<double, 4> uniform(uint32_t frame, uint64_t index) const {
    const std::array<uint32_t, 4> b = bits(frame, index);
    constexpr double scale = 1.0 / 4294967296.0;
    return {(b[0] + 0.5) * scale, (b[1] + 0.5) * scale, (b[2] + 0.5) * scale, (b[3] + 0.5) * scale};
  }

  // Four standard normal numbers (Box-Muller).
  std::array<double, 4> normal(uint32_t frame, uint64_t index) const {
    const std::array<double, 4> u = uniform(frame, index);
    const double ra = std::sqrt(-2 * std::log(u[0])), rb = std::sqrt(-2 * std::log(u[2]));
    const double a = 2 * std::numbers::pi * u[1], b = 2 * std::numbers::pi * u[3];
    return {ra * std::cos(a), ra * std::sin(a), rb * std::cos(b), rb * std::sin(b)};
  }

 private:
  r123::Philox4x32::key_type key_;
  uint32_t stream_;
};

}  // namespace diorama
