#include "tracker/direct_alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tracker/pose_solver.h"

namespace diorama {
namespace {

constexpr float kLargestDifference = 40;  // grey levels; larger ones cost no more
constexpr float kSmallestSigma = 3;       // grey levels, about the sensor's noise
constexpr int kSmallestGradient = 12;     // grey levels, |horizontal| + |vertical| difference
constexpr float kHuber = 1.345f;          // 95% efficiency under normal errors
constexpr size_t kFewestDifferences = 20;
constexpr double kConverged = 1.5e-4;  // rad a pixel of the image is turned by: a tenth of a pixel

// The middle value; the order of the values is lost.
float median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

DirectAlignment::DirectAlignment(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                                 int object, const TrackerOptions& options)
    : model_(model), camera_(camera), rays_(rays), object_(object), options_(options) {}

void DirectAlignment::setReference(const ImagePyramid& image, const SE3& T, const CoverMap& cover) {
  points_.clear();
  const Image<uint8_t>& fine = image.level(kFineLevel);
  if (options_.direct_points == 0 || fine.width < 6 || fine.height < 6) return;
  if (rays_in_camera_.empty())
    rays_in_camera_ = Image<Vector3d>(fine.width, fine.height, Vector3d::Zero());
  const ProjectedBox box = projectedBox(model_, camera_, T);
  const auto clamped = [](double u, int size) {
    return static_cast<int>(std::clamp(toLevel(u, kFineLevel), 2.0, size - 3.0));
  };
  const int x0 = clamped(box.low.x(), fine.width), x1 = clamped(box.high.x(), fine.width);
  const int y0 = clamped(box.low.y(), fine.height), y1 = clamped(box.high.y(), fine.height);
  const bool covered = cover.any();
  std::vector<std::pair<int, int>> strong;
  for (int y = y0; y <= y1; ++y) {
    const uint8_t* row = fine.row(y);
    for (int x = x0; x <= x1; ++x) {
      const uint8_t* p = row + x;
      if (std::abs(p[1] - p[-1]) + std::abs(p[fine.width] - p[-fine.width]) > kSmallestGradient &&
          !(covered && cover.isCovered(fromLevel(Vector2d(x, y), kFineLevel))))
        strong.emplace_back(x, y);
    }
  }
  const Matrix3d R = T.rotationMatrix(), R_model_camera = R.transpose();
  std::vector<Vector2d> pixels;
  std::vector<Vector3d> directions;
  const double step = std::max(1.0, static_cast<double>(strong.size()) / options_.direct_points);
  for (double k = 0; k < static_cast<double>(strong.size()); k += step) {
    const auto [x, y] = strong[static_cast<size_t>(k)];
    const Vector3d& ray = rayThrough(x, y);
    if (ray.z() < 0) continue;
    pixels.push_back(fromLevel(Vector2d(x, y), kFineLevel));
    directions.push_back(R_model_camera * ray);
  }
  const Vector3d eye = T.inverse().translation + model_.centre_object;
  const auto hits = rays_.closestHits(object_, eye, directions);
  for (size_t i = 0; i < hits.size(); ++i)
    if (hits[i]) addPoint(image, T, R, pixels[i], hits[i]->p_object - model_.centre_object);
}

// Undistortion iterates: it is done once for each pixel of the fine level that is ever asked for.
const Vector3d& DirectAlignment::rayThrough(int x, int y) {
  Vector3d& ray = rays_in_camera_(x, y);
  if (ray.z() == 0)
    ray = camera_.unproject(fromLevel(Vector2d(x, y), kFineLevel)).value_or(-Vector3d::UnitZ());
  return ray;
}

void DirectAlignment::addPoint(const ImagePyramid& image, const SE3& T, const Matrix3d& R,
                               const Vector2d& u, const Vector3d& p) {
  Point point;
  point.p = p;
  point.grey.fill(-1);
  const auto projection = camera_.projectWithJacobian(R * p + T.translation);
  if (!projection) return;
  const Matrix26d J = pointJacobian(projection->J, R, p);
  for (int l = kFineLevel; l <= kCoarseLevel; ++l) {
    const Image<uint8_t>& level = image.level(l);
    const double x = toLevel(u.x(), l), y = toLevel(u.y(), l);
    if (!canSample(level, x, y, 1)) continue;
    const float xf = static_cast<float>(x), yf = static_cast<float>(y);
    const size_t i = static_cast<size_t>(l);
    point.grey[i] = sampleBilinear(level, xf, yf);
    const Vector6d d = levelScale(l) * (sampleGradient(level, xf, yf).transpose() * J).transpose();
    point.jacobian[i].setZero();
    point.jacobian[i].head<6>() = d.cast<float>();
  }
  points_.push_back(point);
}

void DirectAlignment::differences(const Image<uint8_t>& image, const SE3& T, int level,
                                  std::vector<Difference>& out) const {
  const Matrix3d R = T.rotationMatrix();
  out.clear();
  for (size_t i = 0; i < points_.size(); ++i) {
    const float reference = points_[i].grey[static_cast<size_t>(level)];
    if (reference < 0) continue;
    const auto u = camera_.project(R * points_[i].p + T.translation);
    if (!u) continue;
    const double x = toLevel(u->x(), level), y = toLevel(u->y(), level);
    if (!canSample(image, x, y)) continue;
    out.push_back(
        {i, sampleBilinear(image, static_cast<float>(x), static_cast<float>(y)) - reference});
  }
}

// Inverse compositional Gauss-Newton (Baker and Matthews 2004): the reference's Jacobians serve all
// iterations, the step is applied inverted. Huber weights; the brightness offset is estimated
// along.
DirectAlignment::Result DirectAlignment::alignLevel(const Image<uint8_t>& image, const SE3& start,
                                                    int level) const {
  const size_t l = static_cast<size_t>(level);
  Result best{start, kLargestDifference};
  SE3 T = start;
  const double converged = kConverged / levelScale(level);
  float offset = 0, sigma = kSmallestSigma;
  std::vector<Difference> found;
  std::vector<float> values;
  for (int iteration = 0; iteration <= options_.direct_iterations; ++iteration) {
    differences(image, T, level, found);
    if (found.size() < kFewestDifferences) break;
    if (iteration % 3 == 0) {  // a robust start of the offset and the scale, now and then
      values.clear();
      for (const Difference& d : found) values.push_back(d.value);
      offset = median(values);
      for (float& v : values) v = std::abs(v - offset);
      sigma = std::max(1.4826f * median(values), kSmallestSigma);
    }
    Eigen::Matrix<float, 8, 8> H = Eigen::Matrix<float, 8, 8>::Zero();
    Eigen::Matrix<float, 8, 1> g = Eigen::Matrix<float, 8, 1>::Zero();
    float cost = 0, weighted = 0, weights = 0;
    for (const Difference& d : found) {
      const Eigen::Matrix<float, 8, 1>& J = points_[d.point].jacobian[l];
      const float e = d.value - offset, magnitude = std::abs(e);
      const float w = magnitude <= kHuber * sigma ? 1 : kHuber * sigma / magnitude;
      H.noalias() += (w * J) * J.transpose();
      g.noalias() += (w * e) * J;
      cost += std::min(magnitude, kLargestDifference);
      weighted += w * d.value;
      weights += w;
    }
    offset = weighted / weights;
    // Points that left the image cost as much as wrong ones.
    cost += kLargestDifference * static_cast<float>(points_.size() - found.size());
    const double mean_cost = static_cast<double>(cost) / static_cast<double>(points_.size());
    if (mean_cost < best.cost)
      best = {T, mean_cost};
    else if (mean_cost > 1.3 * best.cost)
      break;

    Matrix6d damped = H.topLeftCorner<6, 6>().cast<double>();
    damped.diagonal() *= 1.01;
    const Vector6d step = damped.ldlt().solve(g.head<6>().cast<double>());
    if (!step.allFinite() || step.head<3>().norm() > model_.diameter) break;
    const SE3 next = T * exp(-step);
    if (!next.isFinite() || next.translation.z() < 0.2 * model_.diameter) break;
    T = next;
    if (step.tail<3>().norm() < converged && step.head<3>().norm() < converged * T.translation.z())
      break;
  }
  return best;
}

DirectAlignment::Result DirectAlignment::align(const ImagePyramid& image, const SE3& start,
                                               int coarse_level, int fine_level) const {
  Result result{start, kLargestDifference};
  for (int level = coarse_level; level >= fine_level; --level)
    result = alignLevel(image.level(level), result.T_camera_model, level);
  return result;
}

double DirectAlignment::screen(const ImagePyramid& image, const SE3& T, size_t phase) const {
  constexpr size_t kScreenPoints = 75;  // enough to tell starts apart; the best are aligned
  const size_t step = std::max<size_t>(1, points_.size() / kScreenPoints);
  const Image<uint8_t>& level = image.level(kCoarseLevel);
  const Matrix3d R = T.rotationMatrix();
  double sum = 0;
  int count = 0;
  for (size_t i = phase % step; i < points_.size(); i += step, ++count) {
    float difference = kLargestDifference;
    const float reference = points_[i].grey[kCoarseLevel];
    const auto u = camera_.project(R * points_[i].p + T.translation);
    if (reference >= 0 && u) {
      const double x = toLevel(u->x(), kCoarseLevel), y = toLevel(u->y(), kCoarseLevel);
      if (canSample(level, x, y))
        difference =
            std::min(difference,
                     std::abs(sampleBilinear(level, static_cast<float>(x), static_cast<float>(y)) -
                              reference));
    }
    sum += static_cast<double>(difference);
  }
  return count > 0 ? sum / count : static_cast<double>(kLargestDifference);
}

SE3 DirectAlignment::search(const ImagePyramid& image, const SE3& predicted, const SE3& last,
                            uint32_t frame_index) const {
  const Random random(static_cast<uint64_t>(options_.seed), RandomStream::kTracker);
  struct Start {
    double cost;
    SE3 T;
  };
  std::vector<Start> starts;
  const double depth = last.translation.z();
  for (int k = 0; k < options_.rescue_screened; ++k) {
    SE3 T = k % 2 == 1 ? last : predicted;
    if (k > 1) {
      const uint64_t index = 2 * static_cast<uint64_t>(k);
      const auto a = random.normal(frame_index, index), b = random.normal(frame_index, index + 1);
      Vector6d xi;
      xi << 0.5 * depth * options_.rescue_sigma * Vector3d(a[0], a[1], a[2]),
          2 * options_.rescue_sigma * Vector3d(b[0], b[1], b[2]);
      T = T * exp(xi);
    }
    starts.push_back({screen(image, T, static_cast<size_t>(k) % 4), T});
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Start& a, const Start& b) { return a.cost < b.cost; });
  starts.resize(std::min(starts.size(), static_cast<size_t>(options_.rescue_starts)));

  Result best{predicted, 1e9};
  for (const Start& start : starts) {
    const Result result = align(image, start.T, kCoarseLevel, kCoarseLevel);
    if (result.cost < best.cost) best = result;
  }
  return align(image, best.T_camera_model).T_camera_model;
}

}  // namespace diorama
