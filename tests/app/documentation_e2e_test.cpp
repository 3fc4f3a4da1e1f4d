// The commands in README.md and docs/ do what they are said to do.
#include <gtest/gtest.h>

#include "core/files.h"
#include "core/text.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;

// The lines of the ```sh blocks of a page; a trailing backslash joins lines.
std::vector<std::string> shellLines(const fs::path& page) {
  std::vector<std::string> lines;
  bool inside = false, joined = false;
  for (std::string_view line : split(readFile(page), '\n')) {
    line = trim(line);
    if (line.starts_with("```")) {
      inside = !inside && line == "```sh";
      continue;
    }
    if (!inside || line.empty() || line.front() == '#') continue;
    std::string text(line);
    const bool more = text.back() == '\\';
    if (more) text.pop_back();
    joined ? static_cast<void>(lines.back() += text) : lines.push_back(text);
    joined = more;
  }
  return lines;
}

// Blocks whose first line is `# file: NAME` are files that the page tells its reader to write.
void writeFilesOf(const fs::path& page, const fs::path& folder) {
  std::string name, content;
  bool inside = false;
  for (std::string_view line : split(readFile(page), '\n')) {
    if (line.starts_with("```")) {
      if (!name.empty()) writeFileAtomically(folder / name, content);
      inside = !inside;
      name.clear();
      content.clear();
    } else if (inside && content.empty() && line.starts_with("# file: ")) {
      name = std::string(trim(line.substr(8)));
    }
    if (inside && !line.starts_with("```")) content += std::string(line) + "\n";
  }
}

TEST(Documentation, EveryCommandWorks) {
  const test::TemporaryFolder folder;
  const fs::path root = DIORAMA_SOURCE_DIR, work = folder / "work";
  fs::create_directories(work);
  for (const char* name : {"scenes", "scripts", "models", "options"})
    fs::create_directory_symlink(root / name, work / name);
  std::vector<fs::path> pages = {root / "README.md"};
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "docs"))
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  int count = 0;
  for (const fs::path& page : pages) {
    writeFilesOf(page, work);
    for (std::string line : shellLines(page)) {
      SCOPED_TRACE(page.string() + ": " + line);
      if (line == "scripts/demo" || line.starts_with("scripts/test") ||
          line.starts_with("scripts/accept") || line.starts_with("cmake ")) {
        // These build the project that runs this test; continuous integration runs them.
        const std::string program(splitBlanks(line).front());
        EXPECT_TRUE(program == "cmake" || fs::exists(root / program));
        continue;
      }
      if (line.starts_with("diorama ")) line = test::shellQuoted(DIORAMA_BINARY) + line.substr(7);
      if (line.starts_with("scripts/import") && !fs::exists("/usr/share/visp-images-data"))
        continue;
      const test::ProgramResult result = test::runShell(line, work, folder);
      EXPECT_EQ(result.code, 0) << result.err;
      ++count;
    }
  }
  EXPECT_GE(count, 5);
}

}  // namespace
}  // namespace diorama
