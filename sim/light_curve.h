// How bright and of which colour all light of a scene is over time, relative to what the scene
// says.
#pragma once

#include <string>
#include <vector>

#include "core/types.h"
#include "core/yaml.h"

namespace diorama {

class LightCurve {
 public:
  // [[t, gain], ...] or [[t, red, green, blue], ...]: seconds, strictly increasing; gains from 0 to
  // 1000. Throws InputError.
  void readYaml(const YamlValue& value);
  std::string toYaml() const;

  // Linear between two times, constant before the first and after the last; 1 without any.
  Vector3d at(double time_s) const;
  bool constant() const { return knots_.size() < 2; }

 private:
  struct Knot {
    double time_s = 0;
    Vector3d gain;  // red, green, blue
  };
  std::vector<Knot> knots_;
};

}  // namespace diorama
