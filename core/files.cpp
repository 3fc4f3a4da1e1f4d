#include "core/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/errors.h"

namespace diorama {
namespace fs = std::filesystem;

std::string readFile(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) throw MissingInputError(file, "it is a folder");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw MissingInputError(file);
  std::ostringstream content;
  content << in.rdbuf();
  if (in.bad()) throw MissingInputError(file, "reading it failed");
  return std::move(content).str();
}

void writeFileAtomically(const fs::path& file, std::string_view content) {
  const fs::path partial = file.string() + ".partial" + std::to_string(::getpid());
  const int descriptor = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor < 0) throw OutputError(file, std::strerror(errno));
  const auto fail = [&](bool open) {
    const int reason = errno;
    if (open) ::close(descriptor);
    ::unlink(partial.c_str());
    throw OutputError(file, std::strerror(reason));
  };
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(true);
    content.remove_prefix(static_cast<size_t>(written));
  }
  if (::close(descriptor) != 0) fail(false);
  if (::rename(partial.c_str(), file.c_str()) != 0) fail(false);
}

void createFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw OutputError(folder, error.message());
}

fs::path dataFolder() {
  if (const char* folder = std::getenv("DIORAMA_DATA")) return folder;
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) {
    for (fs::path folder = program.parent_path(); folder.has_relative_path();
         folder = folder.parent_path()) {
      if (fs::is_directory(folder / "models") && fs::is_directory(folder / "scenes")) return folder;
      const fs::path shared = folder / "share" / "diorama";
      if (fs::is_directory(shared / "models")) return shared;
    }
  }
  return fs::current_path();
}

fs::path cacheFolder() {
  if (const char* folder = std::getenv("DIORAMA_CACHE")) return folder;
  if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder)
    return fs::path(folder) / "diorama";
  if (const char* home = std::getenv("HOME"); home && *home)
    return fs::path(home) / ".cache" / "diorama";
  return fs::temp_directory_path() / "diorama-cache";
}

}  // namespace diorama
