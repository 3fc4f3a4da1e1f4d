// A triangle mesh with the attributes that a renderer needs; estimators use positions, triangles
// and textures.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "core/types.h"

namespace diorama {

// Colours are linear RGB.
struct Material {
  std::string name;                             // empty: the one of what has none
  Vector3f diffuse = Vector3f::Constant(0.7f);  // albedo, multiplied with the texture
  std::filesystem::path texture;                // sRGB image; empty = none
  float specular = 0.04f;                       // reflectance at normal incidence
  float shininess = 30;                         // Blinn-Phong exponent
  Vector3f emission = Vector3f::Zero();         // radiance
};

struct Mesh {
  std::vector<Vector3f> positions;         // m, object frame
  std::vector<Vector3f> normals;           // unit; empty or one per position
  std::vector<Eigen::Vector2f> uvs;        // OBJ convention, v upwards; empty or one per position
  std::vector<Eigen::Vector3i> triangles;  // indices, counter-clockwise from outside
  std::vector<int> triangle_materials;     // index into materials, one per triangle
  std::vector<Material> materials;

  // Whether anything is known of how it looks.
  bool hasMaterials() const;

  Vector3f minCorner() const;
  Vector3f maxCorner() const;
  // Diagonal of the axis-aligned bounding box, m.
  double diameter() const { return static_cast<double>((maxCorner() - minCorner()).norm()); }
};

}  // namespace diorama
