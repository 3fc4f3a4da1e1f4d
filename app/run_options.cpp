#include "app/run_options.h"

namespace diorama {

SplitOverrides splitOverrides(const std::vector<std::string>& sets) {
  SplitOverrides out;
  for (const std::string& set : sets) {
    YamlOverride change = parseOverride(set);
    const std::string& head = change.path.front();
    const bool estimator =
        head == "tracker" || head == "mapper" || head == "detector" || head == "training";
    (estimator ? out.estimators : out.scene).push_back(std::move(change));
  }
  return out;
}

RunOptions readRunOptions(const std::optional<std::filesystem::path>& file,
                          const std::vector<YamlOverride>& overrides) {
  YamlMap map = file ? loadYaml(*file, overrides) : parseYaml("", "--set", overrides);
  RunOptions options;
  readOptions(map, "tracker", options.tracker);
  readOptions(map, "mapper", options.mapper);
  readOptions(map, "detector", options.detector);
  readOptions(map, "training", options.training);
  map.finish();
  if (const auto problem = options.mapper.problem()) map.require("mapper").fail(*problem);
  return options;
}

std::string toYaml(const RunOptions& options) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  writeOptions(out, "tracker", options.tracker);
  writeOptions(out, "mapper", options.mapper);
  writeOptions(out, "detector", options.detector);
  writeOptions(out, "training", options.training);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace diorama
