#include "tracker/edge_profile.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace diorama {
namespace {

// The extremum of a step with a ramp behind it moves by half the variance of the smoothing (pixel,
// profile, derivative: 1 to 2 px^2) times the ramp over the step, which looks smaller from there.
constexpr float kRampShift_px = 1;
constexpr int kTangentTaps = 1;  // on each side: profiles are averaged over 3 parallels

// Cameras code about the root of the light.
float lightOf(float grey) { return grey * grey; }

// Smoothed central difference: a step of height h gives h / 2 at its place.
float derivative(const float* v, int i) {
  return (2 * (v[i + 1] - v[i - 1]) + v[i + 2] - v[i - 2]) / 6;
}

// Sub-pixel place of the greatest change that is uphill from i, a step away at most, by a parabola.
float peakNear(int i, int first, int last, const float* light) {
  const auto value = [&](int k) { return std::abs(derivative(light, k)); };
  if (i < last && value(i + 1) > value(i) && value(i + 1) >= value(i - 1))
    ++i;
  else if (i > first && value(i - 1) > value(i))
    --i;
  const float l = value(i - 1), m = value(i), r = value(i + 1), curvature = l - 2 * m + r;
  const float shift = curvature < -1e-6f * m ? 0.5f * (l - r) / curvature : 0;
  return static_cast<float>(i) + std::clamp(shift, -0.5f, 0.5f);
}

// How much more the light goes on rising behind a step at x than before it, over the step.
float rampBehind(float x, int length, const float* light) {
  const auto at = [&](float place) {
    const float inside = std::clamp(place, 0.f, static_cast<float>(length) - 1.001f);
    const int k = static_cast<int>(inside);
    return light[k] + (inside - static_cast<float>(k)) * (light[k + 1] - light[k]);
  };
  const float before = at(x - 1), after = at(x + 1), step = after - before;
  const float ramp = (at(x + 3) - after) - (before - at(x - 3));
  return std::abs(ramp) >= std::abs(step) ? std::copysign(1.f, ramp * step) : ramp / step;
}

// Arrays are filled in whole vectors.
constexpr int wholeVectors(int length) { return (length + 7) / 8 * 8; }

// The places that a profile is made from, one parallel after the other.
struct Places {
  static constexpr int kTaps = 2 * kTangentTaps + 1;
  static constexpr int kMost = kTaps * wholeVectors(EdgeProfile::kMaxLength);

  Places(const Vector2d& u_px, const Vector2d& step_px, int length, int image_width)
      : each(wholeVectors(length)) {
    const float x = static_cast<float>(u_px.x()), y = static_cast<float>(u_px.y());
    const float nx = static_cast<float>(step_px.x()), ny = static_cast<float>(step_px.y());
    const int middle = length / 2, last = length - 1;
    for (int tap = 0; tap < kTaps; ++tap) {
      const float aside = static_cast<float>(tap - kTangentTaps);
      const float x0 = x - aside * ny, y0 = y + aside * nx;
      for (int k = 0, i = tap * each; k < each; ++k, ++i) {
        const float along = static_cast<float>(std::min(k, last) - middle);
        const float px = x0 + along * nx, py = y0 + along * ny;
        const int xi = static_cast<int>(px), yi = static_cast<int>(py);
        pixel[i] = yi * image_width + xi;
        a[i] = px - static_cast<float>(xi);
        b[i] = py - static_cast<float>(yi);
      }
    }
  }

  int each;  // of one parallel; behind its end, its last place is repeated
  int pixel[kMost];
  float a[kMost], b[kMost];  // of the way to the next pixel and row
};

// Four bytes from each place on. Pixels are read one after the other, so that what follows
// calculates with many at once.
class Words {
 public:
  template <class Pixel>
  Words(const Pixel* image, const Places& places) {
    for (int i = 0; i < Places::kTaps * places.each; ++i)
      std::memcpy(word_ + i, image + places.pixel[i], sizeof(uint32_t));
  }
  float light(int i, int byte) const {
    const int shift = 8 * (std::endian::native == std::endian::little ? byte : 3 - byte);
    return lightOf(static_cast<float>(static_cast<int>(word_[i] >> shift & 255)));
  }

 private:
  uint32_t word_[Places::kMost];
};

// The mean over the parallels of light between pixels. corner(i, k): of a place's own pixel, the
// next one, and those below.
template <class Corner>
void meanLight(const Places& places, const Corner& corner, float* out) {
  for (int k = 0; k < places.each; ++k) {
    float sum = 0;
    for (int tap = 0; tap < Places::kTaps; ++tap) {
      const int i = tap * places.each + k;
      const float p = corner(i, 0), q = corner(i, 2);
      const float top = p + places.a[i] * (corner(i, 1) - p);
      const float bottom = q + places.a[i] * (corner(i, 3) - q);
      sum += top + places.b[i] * (bottom - top);
    }
    out[k] = sum / Places::kTaps;
  }
}

void takeRoots(const float* light, int count, float* levels) {
  for (int i = 0; i < count; ++i) levels[i] = std::sqrt(light[i]);
}

}  // namespace

void readGreyProfile(const Image<uint8_t>& image, const Vector2d& u_px, const Vector2d& step_px,
                     int range, EdgeProfile& profile) {
  profile.length = 2 * (range + EdgeProfile::kMargin) + 1;
  const Places places(u_px, step_px, profile.length, image.width);
  const Words above(image.pixels.data(), places), below(image.row(1), places);
  const auto corner = [&](int i, int k) { return (k < 2 ? above : below).light(i, k % 2); };
  float light[wholeVectors(EdgeProfile::kMaxLength)], level[wholeVectors(EdgeProfile::kMaxLength)];
  meanLight(places, corner, light);
  takeRoots(light, places.each, level);
  std::copy_n(light, profile.length, profile.light);
  std::copy_n(level, profile.length, profile.grey);
  std::copy_n(level, profile.length, profile.value);
}

void readColorProfile(const Image<Rgb8>& image, const Vector2d& u_px, const Vector2d& step_px,
                      EdgeProfile& profile) {
  constexpr int kMost = wholeVectors(EdgeProfile::kMaxLength);
  const Places places(u_px, step_px, profile.length, image.width);
  const Words words[4] = {{image.row(0), places},
                          {image.row(0) + 1, places},
                          {image.row(1), places},
                          {image.row(1) + 1, places}};
  float light[3][kMost], level[3][kMost];
  for (int c = 0; c < 3; ++c) {
    meanLight(
        places, [&](int i, int k) { return words[k].light(i, c); }, light[c]);
    takeRoots(light[c], places.each, level[c]);
  }

  const auto change = [&](const auto& channels, int i) {
    return Vector3f(derivative(channels[0], i), derivative(channels[1], i),
                    derivative(channels[2], i));
  };
  float steepness[EdgeProfile::kMaxLength];
  const int first = EdgeProfile::kMargin, end = profile.length - EdgeProfile::kMargin;
  for (int i = first; i < end; ++i) steepness[i] = change(level, i).squaredNorm();
  const auto steepest =
      static_cast<int>(std::max_element(steepness + first, steepness + end) - steepness);
  // A grey step counts as high in colours as in grey values.
  const Vector3f by_level = change(level, steepest).normalized() / std::sqrt(3.f);
  const Vector3f by_light = change(light, steepest).normalized();
  const auto mixed = [](const Vector3f& by, const auto& v, int i) {
    return by[0] * v[0][i] + by[1] * v[1][i] + by[2] * v[2][i];
  };
  for (int i = 0; i < profile.length; ++i) {
    profile.value[i] = mixed(by_level, level, i);
    profile.light[i] = mixed(by_light, light, i);
  }
}

int findProfileEdges(const EdgeProfile& profile, float min_gradient, EdgeCandidate* out,
                     int capacity) {
  constexpr int kMargin = EdgeProfile::kMargin;
  const float* const grey = profile.grey;
  const int middle = profile.length / 2, last = profile.length - 1 - kMargin;
  int count = 0;
  float slope[EdgeProfile::kMaxLength];
  for (int i = kMargin - 1; i <= last + 1; ++i) slope[i] = derivative(profile.value, i);
  for (int i = kMargin; i <= last; ++i) {
    const float m = std::abs(slope[i]);
    if (m >= min_gradient && m >= std::abs(slope[i - 1]) && m > std::abs(slope[i + 1])) {
      const float peak = peakNear(i, kMargin, last, profile.light);
      const float ramp = rampBehind(peak, profile.length, profile.light);
      const float edge = peak - kRampShift_px * ramp;
      const EdgeCandidate found{
          static_cast<double>(edge - static_cast<float>(middle)),
          {slope[i], 0.5f * (grey[i - 2] + grey[i - 3]), 0.5f * (grey[i + 2] + grey[i + 3])},
          true};
      if (count < capacity) {
        out[count++] = found;
      } else {
        EdgeCandidate* weakest = std::max_element(out, out + count, strongerEdge);
        if (strongerEdge(found, *weakest)) *weakest = found;
      }
    }
  }
  return count;
}

}  // namespace diorama
