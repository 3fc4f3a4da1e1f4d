// What `diorama sweep` is to vary, and the cells that follow from it.
//
//   scene: ../orange_juice.yaml       # relative to this file; may be a factor's case instead
//   frames: 0:120                     # run options: method, initial, odometry, quality, frames,
//   every set: {effects.blur: false}        # for all cells, scene or estimator options seeds: [1,
//   2, 3] time_limit_s: 120                 # of one child process factors:
//     - {name: noise, path: effects.read_noise_e, values: [0, 12, 24]}
//     - {name: level, path: occlude.0.visible_fraction, template: "[[0.3, 1], [0.9, {}]]", values:
//     [1, 0.5]}
//     - {name: object, cases: {carton: {scene: ../orange_juice.yaml}, box: {scene:
//     ../pasta_box.yaml}}}
//     - {name: method, values: [ebt, fused]}       # without a path the name is the path
//   thresholds:
//     - {metric: success_5cm_5deg, at_least: 0.95, where: {method: fused, level: {at_least: 0.3}}}
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/yaml.h"

namespace diorama {

using Settings = std::vector<std::pair<std::string, std::string>>;  // path, value in YAML

struct SweepFactor {
  std::string name;
  struct Case {
    std::string label;
    Settings settings;
  };
  std::vector<Case> cases;
};

// Which cells a threshold is for: of one factor.
struct SweepCondition {
  std::string factor;
  std::vector<std::string> labels;  // any of these; empty: any label within the bounds
  std::optional<double> at_least, at_most;
};

struct SweepThreshold {
  std::string metric;
  std::optional<double> at_least, at_most;
  std::vector<SweepCondition> where;
  std::string text;  // for people
};

struct SweepSpec {
  std::string name;
  std::filesystem::path folder;  // of the file
  Settings settings;             // of all cells
  std::vector<SweepFactor> factors;
  std::vector<uint64_t> seeds = {1};
  double time_limit_s = 600;
  double file_limit_mb = 2000;  // of one file that a cell writes
  std::vector<SweepThreshold> thresholds;
  std::string text;  // the file's content
};

// Throws InputError with the place.
SweepSpec readSweepSpec(const std::filesystem::path& file);

struct SweepCell {
  std::vector<size_t> at;  // the case of each factor
  uint64_t seed = 0;
  std::string scene;                 // as the command names it
  std::vector<std::string> options;  // of `run`, without input and output
  std::vector<std::string>
      render;  // of `render`: the same for all cells that see the same pictures
};

// In the order of the table: the last factor varies fastest but for the seed.
std::vector<SweepCell> sweepCells(const SweepSpec& spec);

// Whether a threshold is for this cell.
bool applies(const SweepThreshold& threshold, const SweepSpec& spec, const std::vector<size_t>& at);

}  // namespace diorama
