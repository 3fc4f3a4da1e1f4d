#include "eval/metrics.h"

namespace diorama {
namespace {

template <class Section>
void append(const std::string& prefix, const Section& section, std::vector<MetricValue>& list) {
  Section::visit(section, [&](const char* name, const auto& field) {
    MetricValue value{prefix + name, std::nullopt};
    if (field) value.value = static_cast<double>(*field);
    list.push_back(value);
  });
}

}  // namespace

std::vector<MetricValue> listMetrics(const Metrics& metrics) {
  std::vector<MetricValue> list{{"seed", static_cast<double>(metrics.seed)},
                                {"frames", metrics.frames},
                                {"start_frame", metrics.start_frame}};
  append("camera.", metrics.camera, list);
  for (const NamedObjectMetrics& object : metrics.objects)
    append("objects." + object.name + ".", object.metrics, list);
  append("timing.", metrics.timing, list);
  list.push_back({"peak_memory_mb", metrics.peak_memory_mb});
  return list;
}

}  // namespace diorama
