// The include rules of docs/conventions.md: who may include whom.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace diorama {
namespace {

namespace fs = std::filesystem;

struct Include {
  std::string file;    // relative to the root, with /
  std::string folder;  // first part of it
  std::string header;  // as written
  bool quoted = false;
};

std::vector<Include> includesOf(const std::string& folder) {
  std::vector<Include> includes;
  const fs::path root = DIORAMA_SOURCE_DIR;
  if (!fs::is_directory(root / folder)) return includes;
  const std::regex pattern(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"])re");
  for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".h" && extension != ".cpp") continue;
    std::ifstream in(entry.path());
    std::smatch match;
    for (std::string line; std::getline(in, line);)
      if (std::regex_search(line, match, pattern))
        includes.push_back({entry.path().lexically_relative(root).generic_string(), folder,
                            match[2], match[1] == "\""});
  }
  return includes;
}

const std::map<std::string, std::set<std::string>> kAllowed{
    {"core", {"core"}},
    {"sim", {"sim", "core"}},
    {"tracker", {"tracker", "core"}},
    {"vo", {"vo", "core"}},
    {"mapper", {"mapper", "core"}},
    {"eval", {"eval", "core"}},
    {"app", {"app", "core", "sim", "tracker", "vo", "mapper", "eval"}},
};

TEST(IncludeRules, SiblingsNeverIncludeEachOther) {
  for (const auto& [folder, allowed] : kAllowed) {
    for (const Include& include : includesOf(folder)) {
      const std::string first = include.header.substr(0, include.header.find('/'));
      const bool ours = kAllowed.contains(first);
      EXPECT_TRUE(!ours || allowed.contains(first)) << include.file << ": " << include.header;
      EXPECT_TRUE(ours || !include.quoted)
          << include.file << ": \"" << include.header << "\" is not given from the root";
    }
  }
}

bool startsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

// Which library a header belongs to, where it matters.
std::string libraryOf(const std::string& header) {
  for (const char* start : {"assimp/", "embree3/", "GL/", "ceres/", "OpenGL/", "glog/"})
    if (startsWith(header, start)) return start;
  return "";
}

bool mayUse(const std::string& file, const std::string& library) {
  const bool source = fs::path(file).extension() == ".cpp";
  if (library == "ceres/" || library == "glog/")
    return source && (startsWith(file, "mapper/") || file == "vo/bundle_adjustment.cpp");
  return source && startsWith(file, "sim/");
}

TEST(IncludeRules, LibrariesStayInTheirSources) {
  for (const auto& [folder, allowed] : kAllowed)
    for (const Include& include : includesOf(folder)) {
      const std::string library = libraryOf(include.header);
      EXPECT_TRUE(library.empty() || mayUse(include.file, library))
          << include.file << " includes " << include.header;
    }
}

// Estimators never see ground truth.
TEST(IncludeRules, EstimatorsDoNotIncludeGroundTruth) {
  for (const char* folder : {"tracker", "vo", "mapper"})
    for (const Include& include : includesOf(folder))
      EXPECT_TRUE(include.header != "core/ground_truth.h" &&
                  include.header != "core/frame_source.h")
          << include.file << " includes " << include.header;
}

// The rules bite: the scan sees what is there.
TEST(IncludeRules, TheScanFindsIncludes) {
  EXPECT_GT(includesOf("core").size(), 50u);
  EXPECT_GT(includesOf("mapper").size(), 20u);
  EXPECT_TRUE(mayUse("mapper/graph_solver.cpp", "ceres/"));
  EXPECT_FALSE(mayUse("mapper/graph_solver.h", "ceres/"));
  EXPECT_FALSE(mayUse("tracker/edges.cpp", "embree3/"));
  EXPECT_TRUE(mayUse("vo/bundle_adjustment.cpp", "ceres/"));
}

}  // namespace
}  // namespace diorama
