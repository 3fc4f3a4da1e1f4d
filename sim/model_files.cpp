#include "sim/model_files.h"

#include <algorithm>
#include <cctype>

#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The rest of every line that starts with one of the keywords.
std::vector<std::string> statements(const std::string& content, const std::string& keyword) {
  std::vector<std::string> values;
  for (size_t at = content.find(keyword); at != std::string::npos;
       at = content.find(keyword, at + 1)) {
    const size_t line = content.rfind('\n', at) + 1;  // npos + 1 = 0
    if (!trim(std::string_view(content).substr(line, at - line)).empty()) continue;
    const size_t end = std::min(content.find('\n', at), content.size());
    values.emplace_back(trim(std::string_view(content).substr(at, end - at)));
  }
  return values;
}

// `map_Kd -s 1 1 1 wood.jpg`: the file is the last word; a name with blanks stands alone.
std::vector<std::string> possibleNames(const std::string& statement) {
  const size_t blank = statement.find_first_of(" \t");
  if (blank == std::string::npos) return {};
  const std::string rest(trim(std::string_view(statement).substr(blank)));
  return {rest, std::string(splitBlanks(rest).back())};
}

std::vector<std::string> gltfUris(const std::string& content) {
  std::vector<std::string> uris;
  for (size_t at = content.find("\"uri\""); at != std::string::npos;
       at = content.find("\"uri\"", at + 1)) {
    const size_t begin = content.find('"', at + 5);
    const size_t end = begin == std::string::npos ? begin : content.find('"', begin + 1);
    if (end == std::string::npos) break;
    const std::string uri = content.substr(begin + 1, end - begin - 1);
    if (!uri.starts_with("data:")) uris.push_back(uri);
  }
  return uris;
}

class Collector {
 public:
  explicit Collector(fs::path folder) : folder_(std::move(folder)) {}

  // Adds the first of the names that is a file; whether there is one.
  bool add(const std::vector<std::string>& names) {
    for (std::string name : names) {
      std::replace(name.begin(), name.end(), '\\', '/');
      const fs::path file = (folder_ / name).lexically_normal();
      std::error_code error;
      if (!fs::is_regular_file(file, error)) continue;
      if (std::find(files.begin(), files.end(), file) == files.end()) files.push_back(file);
      return true;
    }
    return false;
  }

  std::vector<fs::path> files;

 private:
  fs::path folder_;
};

void followObj(const std::string& content, Collector& found) {
  const size_t first = found.files.size();
  for (const std::string& library : statements(content, "mtllib"))
    found.add(possibleNames(library));
  const std::vector<fs::path> libraries(found.files.begin() + static_cast<long>(first),
                                        found.files.end());
  for (const fs::path& library : libraries) {
    const std::string materials = readFile(library);
    for (const char* keyword : {"map_", "bump", "disp", "norm", "refl"})
      for (const std::string& statement : statements(materials, keyword))
        found.add(possibleNames(statement));
  }
}

}  // namespace

std::vector<fs::path> modelFiles(const fs::path& mesh) {
  const std::string content = readFile(mesh);
  Collector found(mesh.parent_path());
  found.files.push_back(mesh.lexically_normal());
  const std::string extension = lowerCase(mesh.extension().string());
  if (extension == ".obj") followObj(content, found);
  if (extension == ".gltf")
    for (const std::string& uri : gltfUris(content)) found.add({uri});
  return found.files;
}

std::string modelChecksum(const fs::path& mesh) {
  Sha256 hash;
  for (const fs::path& file : modelFiles(mesh))
    hash.update(file.filename().string() + " " + sha256(readFile(file)) + "\n");
  return hash.hexDigest();
}

std::vector<fs::path> copyModel(const fs::path& mesh, const fs::path& folder) {
  const fs::path home = mesh.lexically_normal().parent_path();
  std::vector<fs::path> copies;
  for (const fs::path& file : modelFiles(mesh)) {
    const fs::path relative = file.lexically_relative(home.empty() ? "." : home);
    if (relative.empty() || *relative.begin() == "..") continue;
    createFolder((folder / relative).parent_path());
    writeFileAtomically(folder / relative, readFile(file));
    copies.push_back(relative);
  }
  return copies;
}

}  // namespace diorama
