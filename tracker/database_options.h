// How an object database is made, and how objects are found with it.
#pragma once

#include "core/options.h"

namespace diorama {

struct TrainingOptions {
  std::string features = "sift";  // or surf
  int views = 60;                 // directions over the sphere: every 26 degrees
  // Distances of the camera, in diameters of the object, in equal ratios. With the camera that
  // films the views (focal length 525 px) the object is 350 to 90 px large.
  double nearest_diameters = 1.5;
  double farthest_diameters = 6;
  int distances = 3;
  int features_per_view = 300;
  template <class V>
  void visit(V& v) {
    v("features", features, {"sift", "surf"});
    v("views", views, Range{4, 2000});
    v("nearest_diameters", nearest_diameters, Range{1.1, 1000});
    v("farthest_diameters", farthest_diameters, Range{1.1, 1000});
    v("distances", distances, Range{1, 20});
    v("features_per_view", features_per_view, Range{1, 100000});
  }
};

}  // namespace diorama
