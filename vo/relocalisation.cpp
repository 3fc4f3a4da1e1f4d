#include "vo/relocalisation.h"

#include <bit>
#include <cstring>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>

#include "vo/corners.h"
#include "vo/sparse_alignment.h"

namespace diorama::vo {
namespace {

constexpr int kCorners = 500;
constexpr int kLargestDistance = 64;  // of 256 bits; chance gives 128
constexpr double kRatio = 0.8;        // to the second best point (Lowe)
constexpr int kFewestMatches = 12;
constexpr double kReprojectionPx = 4;
constexpr int kRansacSteps = 300;
constexpr double kRansacConfidence = 0.999;
constexpr float kPatchDiameterPx = 31;  // of an ORB descriptor

int distance(const auto& a, const auto& b) {
  int bits = 0;
  for (size_t i = 0; i < a.size(); ++i) bits += std::popcount(a[i] ^ b[i]);
  return bits;
}

}  // namespace

Relocalisation::Described Relocalisation::describe(const ImagePyramid& pyramid,
                                                   const std::vector<Vector2d>& pixels,
                                                   const std::vector<int>& levels) {
  Described out;
  // One scale and level of its own: OpenCV is given the image of the corner's level.
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(kCorners, 1.2f, 1);
  for (int level = 0; level < pyramid.levels(); ++level) {
    std::vector<cv::KeyPoint> keypoints;
    for (size_t i = 0; i < pixels.size(); ++i) {
      if (levels[i] != level) continue;
      const Vector2d u = toLevel(pixels[i], level);
      cv::KeyPoint keypoint(static_cast<float>(u.x()), static_cast<float>(u.y()), kPatchDiameterPx,
                            -1, 0, 0);
      keypoint.class_id = static_cast<int>(i);
      keypoints.push_back(keypoint);
    }
    if (keypoints.empty()) continue;
    const Image<uint8_t>& image = pyramid.level(level);
    const cv::Mat view(image.height, image.width, CV_8UC1,
                       const_cast<uint8_t*>(image.pixels.data()));  // only read
    cv::Mat descriptors;
    orb->compute(view, keypoints, descriptors);
    for (size_t k = 0; k < keypoints.size(); ++k) {
      const size_t source = static_cast<size_t>(keypoints[k].class_id);
      Descriptor descriptor;
      std::memcpy(descriptor.data(), descriptors.ptr(static_cast<int>(k)), kDescriptorBytes);
      out.pixels.push_back(pixels[source]);
      out.descriptors.push_back(descriptor);
      out.sources.push_back(source);
    }
  }
  return out;
}

void Relocalisation::learn(const Keyframe& keyframe) {
  std::vector<Vector2d> pixels;
  std::vector<int> levels;
  for (const Feature& feature : keyframe.features) {
    pixels.push_back(feature.u_px);
    levels.push_back(feature.level);
  }
  const Described described = describe(*keyframe.pyramid, pixels, levels);
  for (size_t i = 0; i < described.descriptors.size(); ++i)
    entries_.push_back({keyframe.features[described.sources[i]].point, described.descriptors[i]});
}

void Relocalisation::forgetBadPoints() {
  std::erase_if(entries_, [](const Entry& entry) { return entry.point->bad; });
}

std::vector<SE3> Relocalisation::candidates(const TrackedFrame& frame, const TrackedFrame& last,
                                            const Map& map) const {
  std::vector<SE3> poses;
  if (map.keyframes.empty()) return poses;
  // After a short loss the camera is still near.
  if (const auto aligned = alignSparsely(camera_, last, *frame.pyramid, SE3{}, options_))
    poses.push_back(last.T_world_camera * aligned->T_current_reference.inverse());
  if (const auto matched = fromDescriptors(frame)) poses.push_back(*matched);
  return poses;
}

std::optional<SE3> Relocalisation::fromDescriptors(const TrackedFrame& frame) const {
  const CellGrid grid(camera_.width(), camera_.height(), options_.cell_px);
  const std::vector<uint8_t> occupied(grid.size(), 0);
  std::vector<Vector2d> pixels;
  std::vector<int> levels;
  for (const Corner& corner :
       detectCorners(*frame.pyramid, frame.noise, grid, occupied, kCorners, options_)) {
    pixels.push_back(corner.u_px);
    levels.push_back(corner.level);
  }
  const Described seen = describe(*frame.pyramid, pixels, levels);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> bearings;
  for (size_t i = 0; i < seen.descriptors.size(); ++i) {
    int best = 256, second = 256;
    const MapPoint* match = nullptr;
    for (const Entry& entry : entries_) {
      const int d = distance(seen.descriptors[i], entry.descriptor);
      if (d < best) {
        if (entry.point != match) second = best;
        best = d;
        match = entry.point;
      } else if (d < second && entry.point != match) {
        second = d;
      }
    }
    const auto bearing = camera_.unproject(seen.pixels[i]);
    if (!bearing || best > kLargestDistance || best > kRatio * second) continue;
    points.emplace_back(match->p_world.x(), match->p_world.y(), match->p_world.z());
    bearings.emplace_back(bearing->x(), bearing->y());
  }
  if (static_cast<int>(points.size()) < kFewestMatches) return std::nullopt;
  cv::Mat rotation, translation, inliers;
  const double focal = 0.5 * (camera_.fx() + camera_.fy());
  const bool found = cv::solvePnPRansac(
      points, bearings, cv::Mat::eye(3, 3, CV_64F), {}, rotation, translation, false, kRansacSteps,
      static_cast<float>(kReprojectionPx / focal), kRansacConfidence, inliers, cv::SOLVEPNP_P3P);
  if (!found || inliers.rows < kFewestMatches / 2) return std::nullopt;
  const Vector3d phi(rotation.at<double>(0), rotation.at<double>(1), rotation.at<double>(2));
  const Vector3d t(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
  const SE3 T_world_camera = SE3{expSO3(phi), t}.inverse();
  if (!T_world_camera.isFinite()) return std::nullopt;
  return T_world_camera;
}

}  // namespace diorama::vo
