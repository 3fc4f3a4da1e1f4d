// Option structs that describe themselves: `template <class V> void visit(V& v)` names each field
// once, and reading from YAML, writing to YAML and listing follow from it.
//
//   struct TrackerOptions {
//     double sample_step_px = 8;  // distance of samples along an edge
//     template <class V> void visit(V& v) { v("sample_step_px", sample_step_px, Range{1, 64}); }
//   };
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "core/text.h"
#include "core/yaml.h"

namespace diorama {

// The values that a number may take, both ends included.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
};
inline constexpr Range kPositive{std::numeric_limits<double>::min(), 1e300};
inline constexpr Range kNotNegative{0, 1e300};
inline constexpr Range kFraction{0, 1};

namespace internal {

class OptionReader {
 public:
  explicit OptionReader(YamlMap& map) : map_(map) {}

  void operator()(const std::string& key, bool& field) {
    if (auto value = map_.find(key)) field = value->asBool();
  }
  void operator()(const std::string& key, std::string& field) {
    if (auto value = map_.find(key)) field = value->asString();
  }
  void operator()(const std::string& key, std::string& field,
                  const std::vector<std::string>& choices) {
    if (auto value = map_.find(key)) field = choices[value->asChoice(choices)];
  }
  template <class Value>
  requires requires(Value v, const YamlValue& y) { v.readYaml(y); }
  void operator()(const std::string& key, Value& field) {
    if (auto value = map_.find(key)) field.readYaml(*value);
  }
  void operator()(const std::string& key, int& field, Range range = {}) {
    if (auto value = map_.find(key)) check(*value, field = value->asInt(), range);
  }
  void operator()(const std::string& key, double& field, Range range = {}) {
    if (auto value = map_.find(key)) check(*value, field = value->asDouble(), range);
  }
  template <class Options>
  requires requires(Options o, OptionReader& v) { o.visit(v); }
  void operator()(const std::string& key, Options& field) {
    auto value = map_.find(key);
    if (!value) return;
    YamlMap map = value->asMap();
    OptionReader reader(map);
    field.visit(reader);
    map.finish();
  }

 private:
  static void check(const YamlValue& value, double number, Range range) {
    if (number >= range.min && number <= range.max) return;
    const double smallest = std::numeric_limits<double>::min();
    if (range.min == smallest) value.fail("must be above 0");
    if (range.max >= 1e300) value.fail("must be at least " + formatNumber(range.min));
    value.fail("must be between " + formatNumber(range.min) + " and " + formatNumber(range.max));
  }
  YamlMap& map_;
};

class OptionWriter {
 public:
  explicit OptionWriter(YAML::Emitter& out) : out_(out) {}

  void operator()(const std::string& key, const bool& field) { put(key, field ? "true" : "false"); }
  void operator()(const std::string& key, const std::string& field) {
    out_ << YAML::Key << key << YAML::Value << field;
  }
  void operator()(const std::string& key, const std::string& field,
                  const std::vector<std::string>&) {
    (*this)(key, field);
  }
  template <class Value>
  requires requires(Value v) { v.toYaml(); }
  void operator()(const std::string& key, const Value& field) {
    out_ << YAML::Key << key << YAML::Value << YAML::Load(field.toYaml());
  }
  void operator()(const std::string& key, const int& field, Range = {}) {
    put(key, std::to_string(field));
  }
  void operator()(const std::string& key, const double& field, Range = {}) {
    put(key, formatNumber(field));
  }
  template <class Options>
  requires requires(Options o, OptionWriter& v) { o.visit(v); }
  void operator()(const std::string& key, Options& field) {
    out_ << YAML::Key << key << YAML::Value << YAML::BeginMap;
    field.visit(*this);
    out_ << YAML::EndMap;
  }

 private:
  void put(const std::string& key, const std::string& text) {
    out_ << YAML::Key << key << YAML::Value << text;
  }
  YAML::Emitter& out_;
};

}  // namespace internal

// Reads the fields of `options` from `key` of a mapping, if it is there; unknown keys inside are
// errors.
template <class Options>
void readOptions(YamlMap& map, const std::string& key, Options& options) {
  internal::OptionReader reader(map);
  reader(key, options);
}

// Writes `key: {field: value, ...}` into an open mapping.
template <class Options>
void writeOptions(YAML::Emitter& out, const std::string& key, Options options) {
  internal::OptionWriter writer(out);
  writer(key, options);
}

}  // namespace diorama
