// Whole files, read and written so that no half-written one is left under its final name.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace diorama {

// Throws MissingInputError.
std::string readFile(const std::filesystem::path& file);

// A file that is written piece by piece beside its final name and renamed by commit(); without it
// nothing is left. All functions throw OutputError (disk full, no permission).
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path file);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  void write(std::string_view content);
  void commit();

 private:
  std::filesystem::path file_, partial_;
  int descriptor_ = -1;
  bool committed_ = false;
};

// The same with all content at once.
void writeFileAtomically(const std::filesystem::path& file, std::string_view content);

// Creates a folder and its parents; throws OutputError.
void createFolder(const std::filesystem::path& folder);

// The folder with models/ and scenes/ of this installation: DIORAMA_DATA, else beside the program,
// else the source tree.
std::filesystem::path dataFolder();

// Where expensive results are kept between runs: DIORAMA_CACHE, else the user's cache folder.
std::filesystem::path cacheFolder();

}  // namespace diorama
