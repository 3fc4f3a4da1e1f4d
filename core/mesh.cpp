#include "core/mesh.h"

#include <algorithm>

#include "core/errors.h"

namespace diorama {

bool Mesh::hasMaterials() const {
  return std::any_of(materials.begin(), materials.end(),
                     [](const Material& m) { return !m.name.empty() || !m.texture.empty(); });
}

Vector3f Mesh::minCorner() const {
  DIORAMA_CHECK(!positions.empty());
  Vector3f corner = positions.front();
  for (const Vector3f& p : positions) corner = corner.cwiseMin(p);
  return corner;
}

Vector3f Mesh::maxCorner() const {
  DIORAMA_CHECK(!positions.empty());
  Vector3f corner = positions.front();
  for (const Vector3f& p : positions) corner = corner.cwiseMax(p);
  return corner;
}

}  // namespace diorama
