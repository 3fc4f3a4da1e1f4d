#include "tracker/edge_profile.h"

#include <algorithm>
#include <cmath>

#include "core/image_sampling.h"

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

// Calls use(i, x, y) for every place that value i of the profile is the mean of.
template <class Use>
void forPlaces(const Vector2d& u_px, const Vector2d& step_px, int length, const Use& use) {
  const float x = static_cast<float>(u_px.x()), y = static_cast<float>(u_px.y());
  const float nx = static_cast<float>(step_px.x()), ny = static_cast<float>(step_px.y());
  for (int i = 0; i < length; ++i) {
    const float px = x + static_cast<float>(i - length / 2) * nx;
    const float py = y + static_cast<float>(i - length / 2) * ny;
    for (int k = -kTangentTaps; k <= kTangentTaps; ++k)
      use(i, px - static_cast<float>(k) * ny, py + static_cast<float>(k) * nx);
  }
}

// Light between pixels.
Vector3f colorAt(const Image<Rgb8>& image, float x, float y) {
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const float a = x - static_cast<float>(xi), b = y - static_cast<float>(yi);
  const auto light = [](const Rgb8& p) {
    return Vector3f(lightOf(p.r), lightOf(p.g), lightOf(p.b));
  };
  const Rgb8 *p = image.row(yi) + xi, *q = p + image.width;
  return (1 - b) * ((1 - a) * light(p[0]) + a * light(p[1])) +
         b * ((1 - a) * light(q[0]) + a * light(q[1]));
}

}  // namespace

void readGreyProfile(const Image<uint8_t>& image, const Vector2d& u_px, const Vector2d& step_px,
                     int range, EdgeProfile& profile) {
  profile.length = 2 * (range + EdgeProfile::kMargin) + 1;
  std::fill_n(profile.light, profile.length, 0.f);
  forPlaces(u_px, step_px, profile.length, [&](int i, float x, float y) {
    profile.light[i] += sampleBilinear(image, x, y, lightOf) / (2 * kTangentTaps + 1);
  });
  for (int i = 0; i < profile.length; ++i)
    profile.grey[i] = profile.value[i] = std::sqrt(profile.light[i]);
}

void readColorProfile(const Image<Rgb8>& image, const Vector2d& u_px, const Vector2d& step_px,
                      EdgeProfile& profile) {
  float light[3][EdgeProfile::kMaxLength], level[3][EdgeProfile::kMaxLength];
  for (auto& channel : light) std::fill_n(channel, profile.length, 0.f);
  forPlaces(u_px, step_px, profile.length, [&](int i, float x, float y) {
    const Vector3f color = colorAt(image, x, y) / (2 * kTangentTaps + 1);
    for (int c = 0; c < 3; ++c) light[c][i] += color[c];
  });
  for (int c = 0; c < 3; ++c)
    for (int i = 0; i < profile.length; ++i) level[c][i] = std::sqrt(light[c][i]);

  const auto change = [&](const auto& channels, int i) {
    return Vector3f(derivative(channels[0], i), derivative(channels[1], i),
                    derivative(channels[2], i));
  };
  int steepest = EdgeProfile::kMargin;
  for (int i = steepest; i < profile.length - EdgeProfile::kMargin; ++i)
    if (change(level, i).squaredNorm() > change(level, steepest).squaredNorm()) steepest = i;
  // A grey step counts as high in colours as in grey values.
  const Vector3f by_level = change(level, steepest).normalized() / std::sqrt(3.f);
  const Vector3f by_light = change(light, steepest).normalized();
  for (int i = 0; i < profile.length; ++i) {
    profile.value[i] = by_level.dot(Vector3f(level[0][i], level[1][i], level[2][i]));
    profile.light[i] = by_light.dot(Vector3f(light[0][i], light[1][i], light[2][i]));
  }
}

int findProfileEdges(const EdgeProfile& profile, float min_gradient, EdgeCandidate* out,
                     int capacity) {
  constexpr int kMargin = EdgeProfile::kMargin;
  const float* const grey = profile.grey;
  const int middle = profile.length / 2, last = profile.length - 1 - kMargin;
  int count = 0;
  float left = derivative(profile.value, kMargin - 1), here = derivative(profile.value, kMargin);
  for (int i = kMargin; i <= last; ++i) {
    const float right = derivative(profile.value, i + 1), m = std::abs(here);
    if (m >= min_gradient && m >= std::abs(left) && m > std::abs(right)) {
      const float peak = peakNear(i, kMargin, last, profile.light);
      const float ramp = rampBehind(peak, profile.length, profile.light);
      const float edge = peak - kRampShift_px * ramp;
      const EdgeCandidate found{
          static_cast<double>(edge - static_cast<float>(middle)),
          {here, 0.5f * (grey[i - 2] + grey[i - 3]), 0.5f * (grey[i + 2] + grey[i + 3])},
          true};
      if (count < capacity) {
        out[count++] = found;
      } else {
        EdgeCandidate* weakest = std::max_element(out, out + count, strongerEdge);
        if (strongerEdge(found, *weakest)) *weakest = found;
      }
    }
    left = here;
    here = right;
  }
  return count;
}

}  // namespace diorama
