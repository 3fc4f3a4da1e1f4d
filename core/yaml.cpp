#include "core/yaml.h"

#include <cmath>

#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace {

SourcePlace placeOf(const YAML::Node& node, const std::string& file) {
  const YAML::Mark mark = node.Mark();
  if (mark.is_null()) return {file};
  return {file, mark.line + 1, mark.column + 1};
}

std::string join(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

std::string quoted(const std::string& path) { return path.empty() ? "the root" : "`" + path + "`"; }

[[noreturn]] void failOverride(const YamlOverride& change, const std::string& what) {
  throw UsageError("--set " + change.text + ": " + what);
}

// The child of a list or mapping that one part of an override's path names; it may be undefined.
YAML::Node child(YAML::Node node, const std::string& key, const YamlOverride& change) {
  if (node.IsScalar()) failOverride(change, "`" + key + "` would stand below a value");
  if (!node.IsSequence()) return node[key];
  const std::optional<int64_t> index = parseInteger(key);
  if (!index || *index < 0 || static_cast<size_t>(*index) >= node.size())
    failOverride(change, "`" + key + "` is no position in a list");
  return node[static_cast<size_t>(*index)];
}

// Sets one value deep in a tree of mappings, making mappings on the way.
void apply(YAML::Node node, const YamlOverride& change) {
  for (size_t i = 0; i + 1 < change.path.size(); ++i) {
    YAML::Node next = child(node, change.path[i], change);
    if (!next.IsDefined() || next.IsNull()) next = YAML::Node(YAML::NodeType::Map);
    node.reset(next);
  }
  try {
    YAML::Node last = child(node, change.path.back(), change);
    last = YAML::Load(change.value);
  } catch (const YAML::Exception& error) {
    failOverride(change, error.msg);
  }
}

}  // namespace

SourcePlace YamlValue::place() const { return placeOf(node_, *file_); }

void YamlValue::fail(const std::string& what, const std::string& hint) const {
  throw InputError(place(), quoted(path_) + " " + what, hint);
}

bool YamlValue::asBool() const {
  bool value = false;
  if (!node_.IsScalar() || !YAML::convert<bool>::decode(node_, value))
    fail("must be true or false");
  return value;
}

int YamlValue::asInt() const {
  const std::optional<int64_t> value =
      node_.IsScalar() ? parseInteger(node_.Scalar()) : std::nullopt;
  if (!value || std::abs(*value) > 2147483647) fail("must be a whole number");
  return static_cast<int>(*value);
}

uint64_t YamlValue::asUint64() const {
  const std::optional<int64_t> value =
      node_.IsScalar() ? parseInteger(node_.Scalar()) : std::nullopt;
  if (!value || *value < 0) fail("must be a whole number, zero or above");
  return static_cast<uint64_t>(*value);
}

double YamlValue::asDouble() const {
  const std::optional<double> value = node_.IsScalar() ? parseNumber(node_.Scalar()) : std::nullopt;
  if (!value) fail("must be a number");
  if (!std::isfinite(*value)) fail("must be finite");
  return *value;
}

std::string YamlValue::asString() const {
  if (!node_.IsScalar()) fail("must be a text");
  return node_.Scalar();
}

std::vector<YamlValue> YamlValue::asList() const {
  if (!node_.IsSequence()) fail("must be a list");
  std::vector<YamlValue> values;
  for (size_t i = 0; i < node_.size(); ++i)
    values.emplace_back(node_[i], file_, path_ + "[" + std::to_string(i) + "]");
  return values;
}

std::vector<double> YamlValue::asDoubles() const {
  std::vector<double> values;
  for (const YamlValue& value : asList()) values.push_back(value.asDouble());
  return values;
}

Vector3d YamlValue::asVector3() const {
  const std::vector<double> v = asDoubles();
  if (v.size() != 3) fail("must have 3 numbers, not " + std::to_string(v.size()));
  return {v[0], v[1], v[2]};
}

YamlMap YamlValue::asMap() const {
  if (!node_.IsMap()) fail("must be a mapping (key: value)");
  return {node_, file_, path_};
}

size_t YamlValue::asChoice(const std::vector<std::string>& names) const {
  const std::string name = asString();
  std::string all;
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return i;
    all += (i ? ", " : "") + names[i];
  }
  fail("cannot be `" + name + "`" + didYouMean(name, names), "possible: " + all);
}

YamlMap::YamlMap(YAML::Node node, std::shared_ptr<const std::string> file, std::string path)
    : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {}

SourcePlace YamlMap::place() const { return placeOf(node_, *file_); }

void YamlMap::fail(const std::string& what, const std::string& hint) const {
  throw InputError(place(), quoted(path_) + " " + what, hint);
}

std::optional<YamlValue> YamlMap::find(const std::string& key) {
  known_.insert(key);
  const YAML::Node& node = node_;
  const YAML::Node child = node[key];
  if (!child.IsDefined() || child.IsNull()) return std::nullopt;
  return YamlValue(child, file_, join(path_, key));
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : node_)
    if (entry.first.IsScalar()) keys.push_back(entry.first.Scalar());
  return keys;
}

YamlValue YamlMap::require(const std::string& key) {
  std::optional<YamlValue> value = find(key);
  if (!value) fail("lacks the key `" + key + "`");
  return *value;
}

void YamlMap::finish() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const SourcePlace place = placeOf(entry.first, *file_);
    if (!entry.first.IsScalar()) throw InputError(place, "a key must be a text");
    const std::string key = entry.first.Scalar();
    if (!seen.insert(key).second)
      throw InputError(place, "`" + join(path_, key) + "` stands twice");
    if (known_.contains(key)) continue;
    const std::vector<std::string> names(known_.begin(), known_.end());
    const std::string near = didYouMean(key, names);
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
    throw InputError(place, "unknown key `" + join(path_, key) + "`" + near,
                     near.empty() ? "known here: " + all : "");
  }
}

YamlOverride parseOverride(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    throw UsageError("--set " + text + ": expected key.path=value");
  YamlOverride change{{}, text.substr(equals + 1), text};
  for (std::string_view key : split(std::string_view(text).substr(0, equals), '.')) {
    if (key.empty()) throw UsageError("--set " + text + ": an empty key in the path");
    change.path.emplace_back(key);
  }
  return change;
}

YamlMap parseYaml(const std::string& content, const std::string& name,
                  const std::vector<YamlOverride>& overrides) {
  auto file = std::make_shared<const std::string>(name);
  YAML::Node root;
  try {
    root = YAML::Load(content);
  } catch (const YAML::Exception& error) {
    throw InputError(SourcePlace{name, error.mark.line + 1, error.mark.column + 1}, error.msg);
  }
  if (root.IsNull()) root = YAML::Node(YAML::NodeType::Map);
  if (!root.IsMap()) throw InputError(placeOf(root, name), "expected a mapping (key: value)");
  for (const YamlOverride& change : overrides) apply(root, change);
  return {root, file, ""};
}

YamlMap loadYaml(const std::filesystem::path& file, const std::vector<YamlOverride>& overrides) {
  return parseYaml(readFile(file), file.string(), overrides);
}

}  // namespace diorama
