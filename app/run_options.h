// The options of all estimators, as `--options FILE.yaml` and `--set` give them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/pipeline_types.h"
#include "core/yaml.h"
#include "mapper/mapper.h"
#include "tracker/database_options.h"
#include "tracker/detector_options.h"
#include "tracker/tracker_options.h"
#include "vo/vo_options.h"

namespace diorama {

struct RunOptions {
  TrackerOptions tracker;
  VoOptions vo;
  MapperOptions mapper;
  DetectorOptions detector;
  TrainingOptions training;
  PipelineOptions pipeline;
};

// Overrides that belong to an estimator (`tracker.`, `vo.`, `mapper.`, ...), and the others (the
// scene's).
struct SplitOverrides {
  std::vector<YamlOverride> estimators, scene;
};
SplitOverrides splitOverrides(const std::vector<std::string>& sets);

// Throws InputError with the place and the nearest name.
RunOptions readRunOptions(const std::optional<std::filesystem::path>& file,
                          const std::vector<YamlOverride>& overrides);

// `tracker: {...}`, `vo: {...}` and so on, with every value.
std::string toYaml(const RunOptions& options);

}  // namespace diorama
