#include "tracker/feature_matcher.h"

#include <algorithm>
#include <cmath>

namespace diorama {

FeatureMatcher::FeatureMatcher(const ObjectDatabase& database, double same_place_m)
    : database_(database),
      same_place_m_(same_place_m),
      index_(database.descriptors, descriptorSize(database.kind)) {}

std::vector<FeatureMatch> FeatureMatcher::match(const Features& image, double max_ratio) const {
  std::vector<FeatureMatch> matches;
  const size_t size = static_cast<size_t>(descriptorSize(database_.kind));
  const auto placeOf = [&](int feature) -> const Vector3f& {
    return database_.features[static_cast<size_t>(feature)].p_object;
  };
  for (size_t q = 0; q < image.points.size(); ++q) {
    const DescriptorIndex::Neighbours found = index_.find(image.descriptors.data() + q * size);
    const DescriptorIndex::Neighbour& nearest = found.front();
    if (nearest.index < 0) continue;
    // The first neighbour that shows another place; one place is seen from several views.
    const auto isOther = [&](const DescriptorIndex::Neighbour& n) {
      return n.index < 0 || (placeOf(n.index) - placeOf(nearest.index)).norm() >=
                                static_cast<float>(same_place_m_);
    };
    auto other = std::find_if(found.begin() + 1, found.end(), isOther);
    if (other == found.end()) --other;
    if (other->index < 0) continue;
    const double ratio = std::sqrt(static_cast<double>(nearest.square) /
                                   std::max(1e-9, static_cast<double>(other->square)));
    if (ratio < max_ratio) matches.push_back({nearest.index, static_cast<int>(q), ratio});
  }
  return matches;
}

}  // namespace diorama
