// How much of the light that arrives fills the sensor: chosen once, fixed, or followed over time.
#pragma once

#include <functional>
#include <vector>

#include "core/image.h"
#include "sim/renderer.h"
#include "sim/scene.h"

namespace diorama {

// What a light meter on the camera sees at a time, under the scene's light as it is written.
using LightMeter = std::function<Image<Radiance>(double time_s)>;

// The exposure at which the radiance that 80% of the pixels stay below becomes a bright grey.
double chooseExposure(const std::vector<Image<Radiance>>& pictures);

// Depends on the scene alone, never on which frames are drawn: the meter is read along the whole
// path before the first one. All gains are parts of the full well per unit of radiance.
class ExposureControl {
 public:
  ExposureControl(const Scene& scene, const LightMeter& meter);

  double gainAt(double time_s) const;

 private:
  double step_s_ = 1;
  std::vector<double> log_gains_;  // at 0, step, 2 step ...; one when it does not change
};

}  // namespace diorama
