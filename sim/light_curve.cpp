#include "sim/light_curve.h"

#include <algorithm>

#include "core/text.h"

namespace diorama {

void LightCurve::readYaml(const YamlValue& value) {
  constexpr double kMostTime_s = 1e6, kMostGain = 1000;
  knots_.clear();
  for (const YamlValue& item : value.asList()) {
    const std::vector<double> v = item.asDoubles();
    if (v.size() != 2 && v.size() != 4) item.fail("must be [t, gain] or [t, red, green, blue]");
    if (!(std::abs(v[0]) <= kMostTime_s)) item.fail("is at no sensible time");
    if (!knots_.empty() && !(v[0] > knots_.back().time_s))
      item.fail("must be later than the one before");
    for (size_t k = 1; k < v.size(); ++k)
      if (!(v[k] >= 0 && v[k] <= kMostGain)) item.fail("must have gains between 0 and 1000");
    knots_.push_back(
        {v[0], v.size() == 2 ? Vector3d::Constant(v[1]).eval() : Vector3d(v[1], v[2], v[3])});
  }
}

std::string LightCurve::toYaml() const {
  std::string text = "[";
  for (const Knot& k : knots_)
    text += (text.size() > 1 ? ", [" : "[") + formatNumber(k.time_s) + ", " +
            formatNumber(k.gain[0]) + ", " + formatNumber(k.gain[1]) + ", " +
            formatNumber(k.gain[2]) + "]";
  return text + "]";
}

Vector3d LightCurve::at(double time_s) const {
  if (knots_.empty()) return Vector3d::Ones();
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), time_s,
                                     [](double t, const Knot& k) { return t < k.time_s; });
  if (next == knots_.begin()) return next->gain;
  const Knot& last = *std::prev(next);
  if (next == knots_.end()) return last.gain;
  const double part = (time_s - last.time_s) / (next->time_s - last.time_s);
  return last.gain + part * (next->gain - last.gain);
}

}  // namespace diorama
