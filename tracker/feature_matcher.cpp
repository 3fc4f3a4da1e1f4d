#include "tracker/feature_matcher.h"

#include <cmath>
#include <opencv2/flann.hpp>

namespace diorama {
namespace {

constexpr int kTrees = 4;       // as in Muja and Lowe (VISAPP 2009)
constexpr int kChecks = 48;     // leaves looked at; twice as many find hardly more
constexpr int kNeighbours = 8;  // one place is seen from several views

cv::Mat toFloats(const std::vector<uint8_t>& descriptors, int size) {
  const int rows = static_cast<int>(descriptors.size()) / size;
  const cv::Mat bytes(rows, size, CV_8U, const_cast<uint8_t*>(descriptors.data()));
  cv::Mat floats;
  bytes.convertTo(floats, CV_32F);
  return floats;
}

// FLANN draws its trees from the thread's generator of OpenCV: here always from the same numbers.
class SeededOpenCv {
 public:
  SeededOpenCv() : saved_(cv::theRNG()) { cv::theRNG() = cv::RNG(1); }
  ~SeededOpenCv() { cv::theRNG() = saved_; }
  SeededOpenCv(const SeededOpenCv&) = delete;
  SeededOpenCv& operator=(const SeededOpenCv&) = delete;

 private:
  cv::RNG saved_;
};

}  // namespace

struct FeatureMatcher::Index {
  cv::Mat descriptors;
  cv::flann::Index trees;
};

FeatureMatcher::FeatureMatcher(const ObjectDatabase& database, double same_place_m)
    : database_(database), same_place_m_(same_place_m) {
  if (database.features.size() < kNeighbours) return;
  index_ = std::make_unique<Index>();
  index_->descriptors = toFloats(database.descriptors, descriptorSize(database.kind));
  const SeededOpenCv seeded;
  index_->trees.build(index_->descriptors, cv::flann::KDTreeIndexParams(kTrees));
}

FeatureMatcher::~FeatureMatcher() = default;

std::vector<FeatureMatch> FeatureMatcher::match(const Features& image, double max_ratio) const {
  std::vector<FeatureMatch> matches;
  if (!index_ || image.points.empty()) return matches;
  const cv::Mat queries = toFloats(image.descriptors, descriptorSize(database_.kind));
  cv::Mat neighbours, squares;
  const SeededOpenCv seeded;
  index_->trees.knnSearch(queries, neighbours, squares, kNeighbours,
                          cv::flann::SearchParams(kChecks));
  for (int q = 0; q < queries.rows; ++q) {
    const int* const found = neighbours.ptr<int>(q);
    const float* const square = squares.ptr<float>(q);
    if (found[0] < 0) continue;
    const Vector3f& place = database_.features[static_cast<size_t>(found[0])].p_object;
    int other = 1;  // the first neighbour that shows another place
    while (other + 1 < kNeighbours && found[other] >= 0 &&
           (database_.features[static_cast<size_t>(found[other])].p_object - place).norm() <
               static_cast<float>(same_place_m_))
      ++other;
    if (found[other] < 0) continue;
    const double ratio = std::sqrt(static_cast<double>(square[0]) /
                                   std::max(1e-9, static_cast<double>(square[other])));
    if (ratio < max_ratio) matches.push_back({found[0], q, ratio});
  }
  return matches;
}

}  // namespace diorama
