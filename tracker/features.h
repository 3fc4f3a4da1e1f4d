// Keypoints with descriptors: SIFT (Lowe 2004) by OpenCV, SURF (Bay et al. 2008) by dlib.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/types.h"

namespace diorama {

enum class FeatureKind { kSift, kSurf };

std::string toString(FeatureKind kind);                      // sift, surf
FeatureKind featureKindFromString(const std::string& name);  // a known name

// Bytes of one descriptor. Distances between descriptors of one kind are Euclidean.
int descriptorSize(FeatureKind kind);

struct Features {
  struct Point {
    Vector2d u_px;
    double radius_px = 0;  // of what the descriptor saw
  };
  std::vector<Point> points;
  std::vector<uint8_t> descriptors;  // points.size() rows
};

// At most `limit` of them, the strongest. None in an image too small to have any.
Features extractFeatures(const Image<uint8_t>& image, FeatureKind kind, int limit);

// The same without the smallest ones, in a third of the time: found in the image at half its size.
Features extractLargeFeatures(const Image<uint8_t>& image, FeatureKind kind, int limit);

}  // namespace diorama
