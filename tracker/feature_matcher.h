// Which places of an object the features of an image may show.
#pragma once

#include <vector>

#include "tracker/descriptor_index.h"
#include "tracker/object_database.h"

namespace diorama {

struct FeatureMatch {
  int feature = 0;   // of the database
  int point = 0;     // of the image
  double ratio = 1;  // distance of the descriptors over that to the nearest one from another place
};

class FeatureMatcher {
 public:
  // The database must outlive this object. Builds the index.
  FeatureMatcher(const ObjectDatabase& database, double same_place_m);

  // At most one match for each point, those with a ratio below max_ratio (Lowe 2004). Thread-safe.
  std::vector<FeatureMatch> match(const Features& image, double max_ratio) const;

 private:
  const ObjectDatabase& database_;
  double same_place_m_;
  DescriptorIndex index_;
};

}  // namespace diorama
