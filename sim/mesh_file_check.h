// What assimp does not look at before it trusts a mesh file.
#pragma once

#include <filesystem>

namespace diorama {

// Throws InputError, with the line where there is one, for a file that is empty or on which assimp
// would read beyond its arrays, abort, or run for minutes: OBJ and OFF.
void checkMeshFile(const std::filesystem::path& file);

}  // namespace diorama
