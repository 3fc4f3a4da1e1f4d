// A run's options as a list for the report.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace diorama {

// [[path, value, usual value or null], ...] of run.yaml's text: the dotted path of each value, and
// what an estimator's option is when nobody sets it. Text that is no YAML gives an empty list.
nlohmann::ordered_json optionList(const std::string& recipe);

}  // namespace diorama
