#include "sim/exposure.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr double kBrightGrey = 0.16;  // of the full well, for the 80th percentile

// The picture in the light of that time.
Image<Radiance> metered(const Scene& scene, const LightMeter& meter, double time_s) {
  Image<Radiance> picture = meter(time_s);
  const Eigen::Vector3f light = scene.effects.lighting.at(time_s).cast<float>();
  for (Radiance& p : picture.pixels) p = {p.r * light[0], p.g * light[1], p.b * light[2]};
  return picture;
}

}  // namespace

double chooseExposure(const std::vector<Image<Radiance>>& pictures) {
  std::vector<float> light;
  for (const Image<Radiance>& picture : pictures)
    for (const Radiance& p : picture.pixels)
      if (const float l = 0.2126f * p.r + 0.7152f * p.g + 0.0722f * p.b; l > 0) light.push_back(l);
  if (light.empty()) return 1;
  const auto rank = light.begin() + static_cast<std::ptrdiff_t>(light.size() * 8 / 10);
  std::nth_element(light.begin(), rank, light.end());
  return kBrightGrey / static_cast<double>(*rank);
}

ExposureControl::ExposureControl(const Scene& scene, const LightMeter& meter) {
  const EffectsOptions& effects = scene.effects;
  const double bias = std::log(effects.exposure_gain);
  if (effects.exposure == "fixed") {
    log_gains_ = {bias};
    return;
  }
  if (effects.exposure == "metered") {
    constexpr int kViews = 8;
    std::vector<Image<Radiance>> pictures;
    for (int view = 0; view < kViews; ++view)
      pictures.push_back(metered(scene, meter, scene.duration_s * (view + 0.5) / kViews));
    log_gains_ = {std::log(chooseExposure(pictures)) + bias};
    return;
  }
  // What the meter wants is followed with a lag of the first order, as cameras do.
  constexpr double kStep_s = 0.1;
  constexpr double kMostSteps = 3000;
  step_s_ = std::max(kStep_s, scene.duration_s / kMostSteps);
  const double follow = 1 - std::exp(-step_s_ / effects.auto_exposure_s);
  for (int k = 0; k * step_s_ < scene.duration_s + step_s_; ++k) {
    const double wanted = std::log(chooseExposure({metered(scene, meter, k * step_s_)})) + bias;
    const double last = log_gains_.empty() ? wanted : log_gains_.back();
    log_gains_.push_back(last + follow * (wanted - last));
  }
}

double ExposureControl::gainAt(double time_s) const {
  const double at = std::clamp(time_s / step_s_, 0.0, static_cast<double>(log_gains_.size() - 1));
  const size_t k = static_cast<size_t>(at);
  const double next = log_gains_[std::min(k + 1, log_gains_.size() - 1)];
  return std::exp(log_gains_[k] + (at - static_cast<double>(k)) * (next - log_gains_[k]));
}

}  // namespace diorama
