#include "app/run_options.h"

#include <algorithm>

namespace diorama {
namespace {

constexpr const char* kSections[] = {"tracker", "vo", "mapper", "detector", "training", "pipeline"};

}  // namespace

SplitOverrides splitOverrides(const std::vector<std::string>& sets) {
  SplitOverrides out;
  for (const std::string& set : sets) {
    YamlOverride change = parseOverride(set);
    const bool estimator = std::find(std::begin(kSections), std::end(kSections),
                                     change.path.front()) != std::end(kSections);
    (estimator ? out.estimators : out.scene).push_back(std::move(change));
  }
  return out;
}

RunOptions readRunOptions(const std::optional<std::filesystem::path>& file,
                          const std::vector<YamlOverride>& overrides) {
  YamlMap map = file ? loadYaml(*file, overrides) : parseYaml("", "--set", overrides);
  RunOptions options;
  readOptions(map, "tracker", options.tracker);
  readOptions(map, "vo", options.vo);
  readOptions(map, "mapper", options.mapper);
  readOptions(map, "detector", options.detector);
  readOptions(map, "training", options.training);
  readOptions(map, "pipeline", options.pipeline);
  map.finish();
  if (const auto problem = options.mapper.problem()) map.require("mapper").fail(*problem);
  return options;
}

std::string toYaml(const RunOptions& options) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  writeOptions(out, "tracker", options.tracker);
  writeOptions(out, "vo", options.vo);
  writeOptions(out, "mapper", options.mapper);
  writeOptions(out, "detector", options.detector);
  writeOptions(out, "training", options.training);
  writeOptions(out, "pipeline", options.pipeline);
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace diorama
