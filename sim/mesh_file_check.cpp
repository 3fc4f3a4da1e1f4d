#include "sim/mesh_file_check.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>
#include <vector>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// A file whose last line ends in the middle of a vertex or face was cut off; assimp would read on.
void checkObjEnd(const fs::path& file, const std::string& content) {
  if (content.ends_with('\n')) return;
  const size_t start = content.find_last_of('\n');
  const std::string last = content.substr(start == std::string::npos ? 0 : start + 1);
  const auto fields = splitBlanks(last);
  if (fields.empty()) return;
  const bool counted =
      fields[0] == "v" || fields[0] == "vn" || fields[0] == "vt" || fields[0] == "f";
  const size_t expected = fields[0] == "vt" ? 3 : 4;
  if ((counted && fields.size() < expected) || fields.back().ends_with('/'))
    throw InputError(file, "the file is cut off in its last line");
}

// OBJ indices count from 1, or backwards from -1; assimp tolerates some that point nowhere.
void checkObjIndices(const fs::path& file, const std::string& content) {
  int64_t count = 0;
  int line_number = 0;
  for (size_t at = 0; at < content.size(); ++line_number) {
    const size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view line = std::string_view(content).substr(at, end - at);
    at = end + 1;
    if (line.starts_with("v ") || line.starts_with("v\t")) ++count;
    if (!line.starts_with("f ") && !line.starts_with("f\t")) continue;
    for (const std::string_view field : splitBlanks(trim(line).substr(1))) {
      const std::string_view text = field.substr(0, field.find('/'));
      const auto index = parseInteger(text);
      if (!index || *index == 0 || *index > count || *index < -count)
        throw InputError(
            SourcePlace{file.string(), line_number + 1, 1},
            "a face refers to vertex " + std::string(text) + " of " + std::to_string(count));
    }
  }
}

// The fields of one line after the other, without comments and blank lines.
class FieldLines {
 public:
  FieldLines(const fs::path& file, std::string_view content) : file_(file), rest_(content) {}

  std::vector<std::string_view> next() {
    while (!rest_.empty()) {
      const size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view line = rest_.substr(0, std::min(end, rest_.find('#')));
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      if (auto fields = splitBlanks(trim(line)); !fields.empty()) return fields;
    }
    fail("the file is cut off");
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(SourcePlace{file_.string(), number_, 1}, what);
  }

 private:
  const fs::path& file_;
  std::string_view rest_;
  int number_ = 0;
};

// `OFF`, the numbers of vertices and faces, a vertex a line, a face a line: its number of vertices
// and their indices.
void checkOff(const fs::path& file, const std::string& content) {
  FieldLines lines(file, content);
  auto header = lines.next();
  // With an n, the dimension of space stands before the numbers.
  if (!header[0].ends_with("OFF") || header[0].find('n') < header[0].size() ||
      header.back() == "BINARY")
    lines.fail("expected a text that begins with OFF");
  header.erase(header.begin());
  if (header.empty()) header = lines.next();
  const auto count = [&](size_t k) {
    const auto value = k < header.size() ? parseInteger(header[k]) : std::nullopt;
    if (!value || *value < 1) lines.fail("expected the numbers of vertices and of faces");
    return *value;
  };
  const int64_t vertices = count(0), faces = count(1);
  for (int64_t i = 0; i < vertices; ++i)
    if (lines.next().size() < 3) lines.fail("a vertex has fewer than three coordinates");
  for (int64_t i = 0; i < faces; ++i) {
    const auto face = lines.next();
    const auto corners = parseInteger(face[0]);
    if (!corners || *corners < 1 || *corners >= static_cast<int64_t>(face.size()))
      lines.fail("a face has fewer vertices than it says, or none");
    for (size_t k = 1; k <= static_cast<size_t>(*corners); ++k) {
      const auto index = parseInteger(face[k]);
      if (!index || *index < 0 || *index >= vertices)
        lines.fail("a face refers to vertex " + std::string(face[k]) + " of " +
                   std::to_string(vertices));
    }
  }
}

}  // namespace

void checkMeshFile(const fs::path& file) {
  const std::string content = readFile(file);
  if (content.empty()) throw InputError(file, "the file is empty");
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".obj") {
    checkObjEnd(file, content);
    checkObjIndices(file, content);
  }
  if (extension == ".off") checkOff(file, content);
}

}  // namespace diorama
