#include "app/sweep_spec.h"

#include <algorithm>

#include "app/run_options.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

const std::vector<std::string> kRunOptions = {"method",  "initial", "odometry",
                                              "quality", "frames",  "every"};

bool isRunOption(const std::string& path) {
  return std::find(kRunOptions.begin(), kRunOptions.end(), path) != kRunOptions.end();
}

YAML::Node plainNode(const YamlValue& value) {
  if (value.isList()) {
    YAML::Node list(YAML::NodeType::Sequence);
    for (const YamlValue& entry : value.asList()) list.push_back(plainNode(entry));
    return list;
  }
  if (value.isMap()) {
    YAML::Node map(YAML::NodeType::Map);
    YamlMap entries = value.asMap();
    for (const std::string& key : entries.keys()) map[key] = plainNode(entries.require(key));
    return map;
  }
  return YAML::Node(value.asString());
}

// A value of any kind as YAML on one line.
std::string flowText(const YamlValue& value) {
  if (value.isText()) return value.asString();
  YAML::Emitter out;
  out << YAML::Flow << plainNode(value);
  return out.c_str();
}

std::string filledTemplate(std::string text, const std::string& value) {
  for (size_t at = 0; (at = text.find("{}", at)) != std::string::npos; at += value.size())
    text.replace(at, 2, value);
  return text;
}

Settings readSettings(const YamlValue& value) {
  Settings settings;
  YamlMap map = value.asMap();
  for (const std::string& key : map.keys()) settings.emplace_back(key, flowText(map.require(key)));
  return settings;
}

SweepFactor readFactor(const YamlValue& value) {
  YamlMap map = value.asMap();
  SweepFactor factor;
  factor.name = map.require("name").asString();
  if (const auto cases = map.find("cases")) {
    YamlMap named = cases->asMap();
    for (const std::string& label : named.keys())
      factor.cases.push_back({label, readSettings(named.require(label))});
  } else {
    const auto path = map.find("path");
    const auto pattern = map.find("template");
    for (const YamlValue& entry : map.require("values").asList()) {
      const std::string text = flowText(entry);
      factor.cases.push_back({text,
                              {{path ? path->asString() : factor.name,
                                pattern ? filledTemplate(pattern->asString(), text) : text}}});
    }
  }
  if (factor.cases.empty()) value.fail("has no values");
  map.finish();
  return factor;
}

std::vector<std::string> labelsOf(const YamlValue& value) {
  if (!value.isList()) return {flowText(value)};
  std::vector<std::string> labels;
  for (const YamlValue& entry : value.asList()) labels.push_back(flowText(entry));
  return labels;
}

std::vector<SweepCondition> readWhere(const YamlValue& value, const SweepSpec& spec) {
  std::vector<SweepCondition> where;
  std::vector<std::string> known;
  for (const SweepFactor& factor : spec.factors) known.push_back(factor.name);
  YamlMap map = value.asMap();
  for (const std::string& name : map.keys()) {
    const YamlValue entry = map.require(name);
    if (std::find(known.begin(), known.end(), name) == known.end())
      entry.fail("is no factor" + didYouMean(name, known));
    SweepCondition condition{name, {}, {}, {}};
    if (entry.isMap()) {
      YamlMap bounds = entry.asMap();
      if (const auto low = bounds.find("at_least")) condition.at_least = low->asDouble();
      if (const auto high = bounds.find("at_most")) condition.at_most = high->asDouble();
      bounds.finish();
    } else {
      condition.labels = labelsOf(entry);
    }
    where.push_back(std::move(condition));
  }
  return where;
}

SweepThreshold readThreshold(const YamlValue& value, const SweepSpec& spec) {
  YamlMap map = value.asMap();
  SweepThreshold threshold;
  threshold.metric = map.require("metric").asString();
  if (const auto low = map.find("at_least")) threshold.at_least = low->asDouble();
  if (const auto high = map.find("at_most")) threshold.at_most = high->asDouble();
  if (!threshold.at_least && !threshold.at_most) value.fail("needs at_least or at_most");
  threshold.text = threshold.metric;
  if (threshold.at_least) threshold.text += " >= " + formatNumber(*threshold.at_least);
  if (threshold.at_most) threshold.text += " <= " + formatNumber(*threshold.at_most);
  if (const auto where = map.find("where")) {
    threshold.where = readWhere(*where, spec);
    threshold.text += " where " + flowText(*where);
  }
  map.finish();
  return threshold;
}

const std::string* find(const Settings& settings, const std::string& path) {
  const std::string* found = nullptr;  // the last one counts
  for (const auto& [key, value] : settings)
    if (key == path) found = &value;
  return found;
}

// A scene as commands name it: from the installation's folder where it lies in that.
std::string sceneName(const fs::path& scene, const fs::path& folder) {
  const fs::path full = fs::weakly_canonical(scene.is_absolute() ? scene : folder / scene);
  const fs::path within = full.lexically_relative(fs::weakly_canonical(dataFolder()));
  return !within.empty() && *within.begin() != ".." ? within.string() : full.string();
}

SweepCell makeCell(const SweepSpec& spec, const std::vector<size_t>& at, uint64_t seed) {
  Settings all = spec.settings;
  for (size_t f = 0; f < at.size(); ++f)
    for (const auto& setting : spec.factors[f].cases[at[f]].settings) all.push_back(setting);
  SweepCell cell{at, seed, "", {}, {}};
  const std::string* scene = find(all, "scene");
  if (!scene) throw InputError(spec.folder / spec.name, "names no scene", "add `scene: FILE`");
  cell.scene = sceneName(*scene, spec.folder);
  for (const std::string& name : kRunOptions)
    if (const std::string* value = find(all, name)) {
      cell.options.insert(cell.options.end(), {"--" + name, *value});
      if (name == "quality" || name == "frames")
        cell.render.insert(cell.render.end(), {"--" + name, *value});
    }
  cell.options.insert(cell.options.end(), {"--seed", std::to_string(seed)});
  cell.render.insert(cell.render.end(), {"--seed", std::to_string(seed)});
  for (const auto& [path, value] : all) {
    if (path == "scene" || isRunOption(path)) continue;
    const std::string set = path + "=" + value;
    cell.options.insert(cell.options.end(), {"--set", set});
    if (!splitOverrides({set}).scene.empty()) cell.render.insert(cell.render.end(), {"--set", set});
  }
  return cell;
}

}  // namespace

SweepSpec readSweepSpec(const fs::path& file) {
  YamlMap map = loadYaml(file);
  SweepSpec spec;
  spec.name = file.stem().string();
  spec.folder = fs::absolute(file).parent_path();
  spec.text = readFile(file);
  if (const auto scene = map.find("scene")) spec.settings.emplace_back("scene", scene->asString());
  for (const std::string& name : kRunOptions)
    if (const auto value = map.find(name)) spec.settings.emplace_back(name, flowText(*value));
  if (const auto set = map.find("set"))
    for (const auto& setting : readSettings(*set)) spec.settings.push_back(setting);
  if (const auto seeds = map.find("seeds")) {
    spec.seeds.clear();
    for (const YamlValue& seed : seeds->asList()) spec.seeds.push_back(seed.asUint64());
    if (spec.seeds.empty()) seeds->fail("has no values");
  }
  if (const auto limit = map.find("time_limit_s")) spec.time_limit_s = limit->asDouble();
  if (const auto limit = map.find("file_limit_mb")) spec.file_limit_mb = limit->asDouble();
  for (const YamlValue& factor : map.require("factors").asList())
    spec.factors.push_back(readFactor(factor));
  if (const auto thresholds = map.find("thresholds"))
    for (const YamlValue& threshold : thresholds->asList())
      spec.thresholds.push_back(readThreshold(threshold, spec));
  map.finish();
  return spec;
}

std::vector<SweepCell> sweepCells(const SweepSpec& spec) {
  std::vector<SweepCell> cells;
  std::vector<size_t> at(spec.factors.size(), 0);
  while (true) {
    for (uint64_t seed : spec.seeds) cells.push_back(makeCell(spec, at, seed));
    size_t f = at.size();
    while (f > 0 && ++at[f - 1] == spec.factors[f - 1].cases.size()) at[--f] = 0;
    if (f == 0) return cells;
  }
}

bool applies(const SweepThreshold& threshold, const SweepSpec& spec,
             const std::vector<size_t>& at) {
  for (const SweepCondition& condition : threshold.where)
    for (size_t f = 0; f < spec.factors.size(); ++f) {
      if (spec.factors[f].name != condition.factor) continue;
      const std::string& label = spec.factors[f].cases[at[f]].label;
      const auto& labels = condition.labels;
      if (!labels.empty() && std::find(labels.begin(), labels.end(), label) == labels.end())
        return false;
      const std::optional<double> value = parseNumber(label);
      if (condition.at_least && !(value && *value >= *condition.at_least)) return false;
      if (condition.at_most && !(value && *value <= *condition.at_most)) return false;
    }
  return true;
}

}  // namespace diorama
