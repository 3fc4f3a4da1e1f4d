// Which files a model consists of.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace diorama {

// The mesh file first, then what it refers to and what is there (materials, textures, buffers), as
// absolute or working-directory paths, each once. OBJ and glTF are followed; other formats are
// taken to be one file. Throws MissingInputError when the mesh is not there.
std::vector<std::filesystem::path> modelFiles(const std::filesystem::path& mesh);

// SHA-256 over the names and contents of these files.
std::string modelChecksum(const std::filesystem::path& mesh);

// Copies the model to a folder so that it can be imported from there: files beside or below the
// mesh keep their relative names, others (`../shared/wood.jpg`) are left out. Throws OutputError.
// Returns the copies, relative to `folder`, the mesh first.
std::vector<std::filesystem::path> copyModel(const std::filesystem::path& mesh,
                                             const std::filesystem::path& folder);

}  // namespace diorama
