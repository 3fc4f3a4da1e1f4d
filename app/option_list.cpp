#include "app/option_list.h"

#include <yaml-cpp/yaml.h>

#include <map>

#include "app/run_options.h"

namespace diorama {
namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;

void flatten(const YAML::Node& node, const std::string& path, Pairs& out) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      const std::string key = entry.first.as<std::string>("");
      flatten(entry.second, path.empty() ? key : path + "." + key, out);
    }
  } else if (node.IsScalar()) {
    out.emplace_back(path, node.Scalar());
  } else {
    YAML::Emitter text;
    text << YAML::Flow << node;
    out.emplace_back(path, text.c_str());
  }
}

Pairs flatten(const std::string& yaml) {
  Pairs pairs;
  try {
    flatten(YAML::Load(yaml), "", pairs);
  } catch (const YAML::Exception&) {
    pairs.clear();
  }
  return pairs;
}

}  // namespace

nlohmann::ordered_json optionList(const std::string& recipe) {
  std::map<std::string, std::string> usual;
  for (const auto& [path, value] : flatten(toYaml(RunOptions{}))) usual[path] = value;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& [path, value] : flatten(recipe)) {
    const auto known = usual.find(path);
    list.push_back(
        {path, value,
         known == usual.end() ? nlohmann::ordered_json() : nlohmann::ordered_json(known->second)});
  }
  return list;
}

}  // namespace diorama
