// A known object: its name, its shape, and the poses in which it looks the same.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mesh.h"
#include "core/se3.h"

namespace diorama {

struct Symmetries {
  std::vector<SE3> discrete;     // without the identity: T_object_object' that look alike
  std::optional<Vector3d> axis;  // unit, through the object's origin: any rotation looks alike
};

struct ObjectModel {
  std::string name;
  Mesh mesh;  // m
  Symmetries symmetries;
};

}  // namespace diorama
