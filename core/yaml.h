// YAML that is checked while it is read: every wrong type, bad value and unknown key is an
// InputError with file, line, column and the nearest known name.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/errors.h"
#include "core/types.h"

namespace diorama {

class YamlMap;

// One value of a YAML file, with the place where it stands.
class YamlValue {
 public:
  YamlValue(YAML::Node node, std::shared_ptr<const std::string> file, std::string path)
      : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {}

  bool asBool() const;
  int asInt() const;
  uint64_t asUint64() const;
  double asDouble() const;  // finite
  std::string asString() const;
  std::vector<double> asDoubles() const;
  Vector3d asVector3() const;
  std::vector<YamlValue> asList() const;
  YamlMap asMap() const;
  bool isMap() const { return node_.IsMap(); }
  bool isList() const { return node_.IsSequence(); }
  bool isText() const { return node_.IsScalar(); }

  // One of the given names, as its position; an error names the nearest.
  size_t asChoice(const std::vector<std::string>& names) const;

  SourcePlace place() const;
  [[noreturn]] void fail(const std::string& what, const std::string& hint = "") const;
  const std::string& path() const { return path_; }  // dotted, from the root

 private:
  YAML::Node node_;
  std::shared_ptr<const std::string> file_;
  std::string path_;
};

// A YAML mapping. Keys that were never asked for are unknown: finish() throws on the first of them.
class YamlMap {
 public:
  YamlMap(YAML::Node node, std::shared_ptr<const std::string> file, std::string path);

  YamlValue require(const std::string& key);
  std::optional<YamlValue> find(const std::string& key);
  bool has(const std::string& key) { return find(key).has_value(); }
  // All keys that are texts, in the order of the file; for mappings whose keys are names.
  std::vector<std::string> keys() const;
  void finish() const;

  SourcePlace place() const;
  [[noreturn]] void fail(const std::string& what, const std::string& hint = "") const;

 private:
  YAML::Node node_;
  std::shared_ptr<const std::string> file_;
  std::string path_;
  std::set<std::string> known_;
};

// A change given on the command line: `key.path=value`, the value in YAML.
struct YamlOverride {
  std::vector<std::string> path;
  std::string value;
  std::string text;  // as given, for messages
};
YamlOverride parseOverride(const std::string& text);

// Reads a file whose root is a mapping. Overrides replace or add values before anything is checked.
// Throws MissingInputError or InputError.
YamlMap loadYaml(const std::filesystem::path& file,
                 const std::vector<YamlOverride>& overrides = {});
YamlMap parseYaml(const std::string& content, const std::string& name,
                  const std::vector<YamlOverride>& overrides = {});

}  // namespace diorama
