// Reading meshes of any format that assimp knows.
#pragma once

#include <filesystem>

#include "core/mesh.h"

namespace diorama {

struct MeshImportOptions {
  double scale = 1;   // metres per unit of the file
  bool y_up = false;  // the file's y axis points up: (x, y, z) becomes (x, -z, y)
};

// The mesh of a file in metres, in the file's own frame (turned when y_up). Faces become triangles,
// identical vertices are joined, triangles without area are dropped. Normals are the file's, or
// made from faces that meet at less than 45 degrees. Materials: Kd is a linear tint, map_Kd an sRGB
// texture found relative to the mesh, Ks (its mean) the reflectance at normal incidence, Ns the
// exponent, Ke the emitted radiance.
// Throws MissingInputError when the file is not there, and InputError when it has no triangles,
// coordinates that are not finite or beyond 100 km, bad indices, or a texture that is not there.
Mesh importMesh(const std::filesystem::path& file, const MeshImportOptions& options = {});

}  // namespace diorama
