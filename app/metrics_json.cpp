#include "app/metrics_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace {

using Json = nlohmann::ordered_json;

template <class T>
Json valueOrNull(const std::optional<T>& value) {
  if (!value) return nullptr;
  if constexpr (std::is_floating_point_v<T>) {
    if (!std::isfinite(*value)) return nullptr;
  }
  return *value;
}

template <class Part>
Json partToJson(const Part& part) {
  Json json = Json::object();
  Part::visit(part, [&](const char* name, const auto& field) { json[name] = valueOrNull(field); });
  return json;
}

template <class Part>
void partFromJson(const Json& json, Part& part) {
  Part::visit(part, [&]<class T>(const char* name, std::optional<T>& field) {
    if (!json.at(name).is_null()) field = json.at(name).get<T>();
  });
}

std::string_view lastName(std::string_view path) { return path.substr(path.rfind('.') + 1); }

}  // namespace

std::string toJson(const Metrics& metrics) {
  Json json;
  json["scene"] = metrics.scene;
  json["method"] = metrics.method;
  json["initial"] = metrics.initial;
  json["seed"] = metrics.seed;
  json["frames"] = metrics.frames;
  json["start_frame"] = valueOrNull(metrics.start_frame);
  json["camera"] = partToJson(metrics.camera);
  json["objects"] = Json::object();
  for (const NamedObjectMetrics& object : metrics.objects)
    json["objects"][object.name] = partToJson(object.metrics);
  json["timing"] = partToJson(metrics.timing);
  json["peak_memory_mb"] = valueOrNull(metrics.peak_memory_mb);
  return json.dump(2) + "\n";
}

Metrics metricsFromJson(const std::filesystem::path& file) {
  return metricsFromText(readFile(file), file);
}

Metrics metricsFromText(const std::string& content, const std::filesystem::path& file) {
  try {
    const Json json = Json::parse(content);
    Metrics metrics;
    json.at("scene").get_to(metrics.scene);
    json.at("method").get_to(metrics.method);
    json.at("initial").get_to(metrics.initial);
    json.at("seed").get_to(metrics.seed);
    json.at("frames").get_to(metrics.frames);
    if (!json.at("start_frame").is_null()) metrics.start_frame = json.at("start_frame").get<int>();
    partFromJson(json.at("camera"), metrics.camera);
    for (const auto& [name, part] : json.at("objects").items()) {
      metrics.objects.push_back({name, {}});
      partFromJson(part, metrics.objects.back().metrics);
    }
    partFromJson(json.at("timing"), metrics.timing);
    if (!json.at("peak_memory_mb").is_null())
      metrics.peak_memory_mb = json.at("peak_memory_mb").get<double>();
    return metrics;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file, std::string("is no metrics.json of a run: ") + error.what());
  }
}

Expectation::Expectation(const std::string& text) : text_(text) {
  const size_t begin = text.find_first_of("<>=!");
  const size_t end = begin == std::string::npos ? begin : text.find_first_not_of("<>=!", begin);
  const auto fail = [&] { throw UsageError("--expect " + text + ": expected METRIC>=VALUE"); };
  if (begin == 0 || end == std::string::npos) fail();
  metric_ = std::string(trim(text.substr(0, begin)));
  relation_ = text.substr(begin, end - begin);
  const std::optional<double> bound = parseNumber(trim(std::string_view(text).substr(end)));
  const bool known = relation_ == ">=" || relation_ == "<=" || relation_ == ">" ||
                     relation_ == "<" || relation_ == "==" || relation_ == "!=";
  if (!known || !bound) fail();
  bound_ = *bound;
}

bool Expectation::holds(double value) const {
  if (relation_ == ">=") return value >= bound_;
  if (relation_ == "<=") return value <= bound_;
  if (relation_ == ">") return value > bound_;
  if (relation_ == "<") return value < bound_;
  return (value == bound_) == (relation_ == "==");
}

bool Expectation::isAbout(const MetricValue& metric) const {
  return metric.path == metric_ || metric.path.ends_with("." + metric_);
}

void Expectation::check(const Metrics& metrics) const {
  std::vector<std::string> names;
  for (const MetricValue& metric : listMetrics(metrics)) {
    if (isAbout(metric)) return;
    names.push_back(metric.path);
    names.emplace_back(lastName(metric.path));
  }
  throw UsageError("--expect " + text_ + ": there is no metric `" + metric_ + "`" +
                   didYouMean(metric_, names));
}

std::string Expectation::missed(const Metrics& metrics) const {
  check(metrics);
  for (const MetricValue& metric : listMetrics(metrics)) {
    if (!isAbout(metric)) continue;
    if (!metric.value) return "missed: " + text_ + " (" + metric.path + " is not known)";
    if (!holds(*metric.value))
      return "missed: " + text_ + " (" + metric.path + " is " + formatNumber(*metric.value) + ")";
  }
  return "";
}

}  // namespace diorama
