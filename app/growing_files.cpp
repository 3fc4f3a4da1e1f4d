#include "app/growing_files.h"

namespace diorama {
namespace {

constexpr size_t kBlock = 1 << 15;  // bytes

}  // namespace

void GrowingFiles::append(const std::string& name, std::string_view text) {
  auto found = files_.find(name);
  if (found == files_.end()) {
    const std::filesystem::path path = folder_ / name;
    createFolder(path.parent_path());
    found = files_.try_emplace(name, path).first;
  }
  Growing& growing = found->second;
  growing.waiting += text;
  if (growing.waiting.size() < kBlock) return;
  growing.file.write(growing.waiting);
  growing.waiting.clear();
}

void GrowingFiles::commit() {
  for (auto& [name, growing] : files_) growing.file.write(growing.waiting);
  for (auto& [name, growing] : files_) growing.file.commit();
  files_.clear();
}

}  // namespace diorama
