#include "app/output_folder.h"

#include "core/errors.h"
#include "core/files.h"

namespace diorama {
namespace fs = std::filesystem;

OutputState prepareOutput(const OutputRequest& request) {
  const fs::path recipe = request.folder / request.recipe_file;
  std::error_code error;
  if (fs::exists(request.folder, error)) {
    if (!fs::is_directory(request.folder))
      throw OutputError(request.folder, "exists and is no folder");
    if (!fs::is_empty(request.folder)) {
      if (!fs::exists(recipe))
        throw OutputError(request.folder, "exists and holds something else; choose another -o");
      if (readFile(recipe) != request.recipe)
        throw OutputError(request.folder,
                          "was made with other options; choose another -o, or delete it");
      if (fs::exists(request.folder / request.marker_file)) return OutputState::kComplete;
      if (!request.resume)
        throw OutputError(request.folder, request.resumable
                                              ? "is incomplete; go on with --resume, or delete it"
                                              : "is incomplete; delete it");
      return OutputState::kResumed;
    }
  }
  createFolder(request.folder);
  try {
    writeFileAtomically(recipe, request.recipe);
  } catch (...) {
    fs::remove(request.folder, error);
    throw;
  }
  return OutputState::kFresh;
}

}  // namespace diorama
