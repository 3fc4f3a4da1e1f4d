// Text files of a run that grow from frame to frame and appear under their names together, at the
// end: a long run keeps none of it in memory, and a disk that is full says so early.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/files.h"

namespace diorama {

class GrowingFiles {
 public:
  explicit GrowingFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // To the end of FOLDER/name, which begins with this; folders of it are made. Throws OutputError.
  void append(const std::string& name, std::string_view text);

  // Without it nothing is left of the files.
  void commit();

 private:
  struct Growing {
    explicit Growing(const std::filesystem::path& path) : file(path) {}
    AtomicFile file;
    std::string waiting;  // to be written with more
  };

  std::filesystem::path folder_;
  std::map<std::string, Growing> files_;
};

}  // namespace diorama
