// JSON that is checked while it is read: what is wrong is an InputError that names the file and the
// place.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/errors.h"

namespace diorama {

class JsonValue {
 public:
  // The whole file. Throws MissingInputError, or InputError with line and column.
  static JsonValue load(const std::filesystem::path& file);

  JsonValue require(const std::string& key) const;
  std::optional<JsonValue> find(const std::string& key) const;
  std::vector<std::pair<std::string, JsonValue>> members() const;  // in the order of the file
  std::vector<JsonValue> asList() const;
  double asDouble() const;  // finite
  int64_t asInteger() const;
  std::string asString() const;
  std::vector<double> asDoubles() const;
  std::vector<double> asDoubles(size_t count) const;

  [[noreturn]] void fail(const std::string& what, const std::string& hint = "") const;

 private:
  using Document = nlohmann::ordered_json;
  JsonValue(std::shared_ptr<const Document> root, const Document* value, std::string file,
            std::string path)
      : root_(std::move(root)), value_(value), file_(std::move(file)), path_(std::move(path)) {}
  JsonValue child(const Document& value, const std::string& key) const;

  std::shared_ptr<const Document> root_;
  const Document* value_;
  std::string file_, path_;
};

}  // namespace diorama
