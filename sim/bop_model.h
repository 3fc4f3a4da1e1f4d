// Models as BOP has them: PLY (ascii) in millimetres, with normals, and one texture.
#pragma once

#include <string>

#include "core/mesh.h"
#include "sim/sequence_files.h"

namespace diorama {

// Writes `name`.ply and, where the whole mesh has one texture, its image beside it. Vertices carry
// the colours of their materials.
void writeBopModel(const Mesh& mesh, const std::string& name, SequenceFiles& files);

}  // namespace diorama
