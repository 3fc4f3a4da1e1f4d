#include "sim/model_lookup.h"

#include <algorithm>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// The names of the folders under models/ that hold `file(name)`.
template <class FileOf>
std::vector<std::string> knownModels(const FileOf& file) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dataFolder() / "models", error)) {
    const std::string name = entry.path().filename().string();
    if (fs::exists(entry.path() / file(name), error)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

// A folder under models/ by its name, or a path relative to the scene.
template <class FileOf>
fs::path find(const std::string& name, const SourcePlace& place, const fs::path& folder,
              const FileOf& file) {
  const bool is_text = !name.empty() && name.size() < 1000 && name.find('\0') == std::string::npos;
  if (!is_text) throw InputError(place, "this is no file name");
  std::error_code error;
  if (name.find('/') == std::string::npos) {
    const fs::path known = dataFolder() / "models" / name / file(name);
    if (fs::is_regular_file(known, error)) return known;
  }
  const fs::path own = (folder / name).lexically_normal();
  if (fs::is_regular_file(own, error)) return own;
  if (fs::is_regular_file(own / file(name), error)) return own / file(name);
  const std::vector<std::string> known = knownModels(file);
  throw MissingInputError(
      place, "there is no model `" + name + "`" + didYouMean(name, known),
      known.empty() ? "there is no models/ here: set DIORAMA_DATA to the folder that has it"
                    : "a folder under models/ or the path of a mesh");
}

std::string meshOf(const std::string& name) { return name + ".obj"; }

}  // namespace

fs::path findModel(const YamlValue& value, const fs::path& scene_folder) {
  return find(value.asString(), value.place(), scene_folder, meshOf);
}

fs::path findModel(const std::string& name) { return find(name, SourcePlace{name}, "", meshOf); }

fs::path findEnvironment(const YamlValue& value, const fs::path& scene_folder) {
  return find(value.asString(), value.place(), scene_folder,
              [](const std::string&) { return "environment.yaml"; });
}

}  // namespace diorama
