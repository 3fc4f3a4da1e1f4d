#include "sim/occlusion_reader.h"

#include "core/text.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace {

template <class Items>
std::vector<std::string> namesOf(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

std::vector<VisibleFraction> readFractions(const YamlValue& value) {
  constexpr double kMaxTime_s = 1e6;
  std::vector<VisibleFraction> knots;
  for (const YamlValue& item : value.asList()) {
    const std::vector<double> v = item.asDoubles();
    if (v.size() != 2) item.fail("must be [time, fraction]");
    if (!(v[0] >= -kMaxTime_s && v[0] <= kMaxTime_s)) item.fail("has a time beyond all bounds");
    if (!(v[1] >= 0 && v[1] <= 1)) item.fail("must have a fraction between 0 and 1");
    if (!knots.empty() && !(v[0] > knots.back().time_s))
      item.fail("must be later than the one before");
    knots.push_back({v[0], v[1]});
  }
  if (knots.empty()) value.fail("is empty", "[[time, fraction], ...]");
  return knots;
}

// hand, hand2, hand3 ... whichever is free.
std::string freeName(const std::string& base, const Scene& scene,
                     const std::vector<OcclusionRequest>& requests) {
  const auto taken = [&](const std::string& name) {
    for (const SceneObject& object : scene.objects)
      if (object.name == name) return true;
    for (const OcclusionRequest& request : requests)
      if (request.name == name) return true;
    return false;
  };
  std::string name = base;
  for (int k = 2; taken(name); ++k) name = base + std::to_string(k);
  return name;
}

OcclusionRequest readOcclusion(const YamlValue& value, const Scene& scene,
                               const std::vector<OcclusionRequest>& before) {
  YamlMap map = value.asMap();
  OcclusionRequest request;
  request.place = value.place();
  request.object = map.require("object").asChoice(namesOf(scene.objects));
  const OccluderKind& kind =
      occluderKinds()[map.require("occluder").asChoice(namesOf(occluderKinds()))];
  request.model = kind.name;
  request.visible_fraction = readFractions(map.require("visible_fraction"));
  if (auto from = map.find("from")) request.side = from->asChoice(sideNames(kind));
  if (auto distance = map.find("distance_m")) request.distance_m = readNumber(*distance, 0.05, 10);
  request.name = freeName(kind.name, scene, before);
  if (auto name = map.find("name")) {
    request.name = readName(*name);
    if (freeName(request.name, scene, before) != request.name)
      name->fail("`" + request.name + "` stands twice");
  }
  map.finish();
  return request;
}

}  // namespace

std::vector<OcclusionRequest> readOcclusions(const YamlValue& value, const Scene& scene) {
  std::vector<OcclusionRequest> requests;
  if (value.isMap()) return {readOcclusion(value, scene, requests)};
  for (const YamlValue& item : value.asList())
    requests.push_back(readOcclusion(item, scene, requests));
  return requests;
}

}  // namespace diorama
