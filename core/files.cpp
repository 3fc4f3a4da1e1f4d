#include "core/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "core/errors.h"

namespace diorama {
namespace fs = std::filesystem;

std::string readFile(const fs::path& file) {
  std::error_code error;
  if (fs::is_directory(file, error)) throw MissingInputError(file, "it is a folder");
  std::ifstream in(file, std::ios::binary);
  if (!in) throw MissingInputError(file);
  const auto size = fs::file_size(file, error);
  std::string content(error ? 0 : size, '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<size_t>(in.gcount()));
  std::ostringstream rest;  // of pipes, which have no size
  if (in) rest << in.rdbuf();
  if (in.bad()) throw MissingInputError(file, "reading it failed");
  return content.append(rest.str());
}

AtomicFile::AtomicFile(fs::path file)
    : file_(std::move(file)), partial_(file_.string() + ".partial" + std::to_string(::getpid())) {
  descriptor_ = ::open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw OutputError(file_, std::strerror(errno));
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!committed_) ::unlink(partial_.c_str());
}

void AtomicFile::write(std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(descriptor_, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw OutputError(file_, std::strerror(errno));
    content.remove_prefix(static_cast<size_t>(written));
  }
}

void AtomicFile::commit() {
  if (::close(std::exchange(descriptor_, -1)) != 0 ||
      ::rename(partial_.c_str(), file_.c_str()) != 0)
    throw OutputError(file_, std::strerror(errno));
  committed_ = true;
}

void writeFileAtomically(const fs::path& file, std::string_view content) {
  AtomicFile out(file);
  out.write(content);
  out.commit();
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
