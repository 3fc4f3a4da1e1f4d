#include "tracker/appearance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr int kGrid_px = 5;           // distance of the points in a picture of the training
constexpr Eigen::Index kFewest = 24;  // points for a comparison
constexpr double kDark = 10;          // grey levels: below them the logarithm is mostly noise
constexpr double kPlain = 0.05;  // standard deviation of logarithms; with less there is no print

// Whether the square around a pixel shows the object only.
bool squareOnObject(const Camera& camera, const RayQuery& rays, int object,
                    const SE3& T_object_camera, const Vector2d& u_px) {
  for (const double dx : {-0.5, 0.5})
    for (const double dy : {-0.5, 0.5}) {
      const auto direction = camera.unproject(u_px + kGrid_px * Vector2d(dx, dy));
      if (!direction || !rays.closestHit(object, T_object_camera.translation,
                                         T_object_camera.rotation * *direction))
        return false;
    }
  return true;
}

using Regressors = Eigen::Matrix<double, Eigen::Dynamic, 4>;

// What is left of y after the best linear combination of the columns; those of a flat side depend
// on one another, hence the ridge.
Eigen::VectorXd unexplained(const Regressors& columns, const Eigen::VectorXd& y) {
  constexpr double kRidge = 1e-6;
  const Eigen::Matrix4d normal = columns.transpose() * columns + kRidge *
                                                                     static_cast<double>(y.size()) *
                                                                     Eigen::Matrix4d::Identity();
  return y - columns * normal.ldlt().solve(columns.transpose() * y);
}

}  // namespace

MeanImage::MeanImage(const Image<uint8_t>& image)
    : width_(image.width),
      height_(image.height),
      sums_(static_cast<size_t>(image.width + 1) * static_cast<size_t>(image.height + 1), 0) {
  const size_t stride = static_cast<size_t>(width_) + 1;
  for (int y = 0; y < height_; ++y) {
    uint64_t row = 0;
    uint64_t* const above = sums_.data() + static_cast<size_t>(y) * stride;
    for (int x = 0; x < width_; ++x) {
      row += image(x, y);
      above[stride + static_cast<size_t>(x) + 1] = above[static_cast<size_t>(x) + 1] + row;
    }
  }
}

std::optional<double> MeanImage::mean(const Vector2d& u_px, double side_px) const {
  const int side = std::clamp(static_cast<int>(std::lround(side_px)), 1, width_ + height_);
  const double left = std::floor(u_px.x() - 0.5 * side + 1),
               top = std::floor(u_px.y() - 0.5 * side + 1);
  if (!(left >= 0 && top >= 0 && left + side <= width_ && top + side <= height_))
    return std::nullopt;
  const size_t stride = static_cast<size_t>(width_) + 1, n = static_cast<size_t>(side);
  const uint64_t* const a =
      sums_.data() + static_cast<size_t>(top) * stride + static_cast<size_t>(left);
  const uint64_t* const b = a + n * stride;
  return static_cast<double>(b[n] - b[0] - a[n] + a[0]) / static_cast<double>(n * n);
}

DatabaseLook takeLook(const Image<uint8_t>& picture, const Camera& camera, const RayQuery& rays,
                      int object_index, const SE3& T_camera_object, const Vector3d& centre_object) {
  const SE3 T_object_camera = T_camera_object.inverse();
  const Vector3d eye = T_object_camera.translation;
  const MeanImage means(picture);
  DatabaseLook look;
  look.direction = (eye - centre_object).normalized().cast<float>();
  look.side_m = static_cast<float>(kGrid_px * (eye - centre_object).norm() / camera.fx());
  for (int y = kGrid_px; y < picture.height - kGrid_px; y += kGrid_px)
    for (int x = kGrid_px; x < picture.width - kGrid_px; x += kGrid_px) {
      const Vector2d u(x, y);
      const auto direction = camera.unproject(u);
      if (!direction) continue;
      const auto hit = rays.closestHit(object_index, eye, T_object_camera.rotation * *direction);
      if (!hit || !squareOnObject(camera, rays, object_index, T_object_camera, u)) continue;
      const auto grey = means.mean(u, kGrid_px);
      if (!grey) continue;
      look.points.push_back(hit->p_object.cast<float>());
      look.normals.push_back(hit->normal.cast<float>());
      look.grey.push_back(static_cast<uint8_t>(std::lround(*grey)));
    }
  return look;
}

std::optional<double> compareLooks(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                   const Camera& camera, const SE3& T_camera_object,
                                   const Vector3d& centre_object) {
  const Vector3f side =
      (T_camera_object.inverse().translation - centre_object).normalized().cast<float>();
  const auto nearest = std::max_element(looks.begin(), looks.end(),
                                        [&](const DatabaseLook& a, const DatabaseLook& b) {
                                          return a.direction.dot(side) < b.direction.dot(side);
                                        });
  if (nearest == looks.end()) return std::nullopt;
  const size_t n = nearest->points.size();
  Regressors regressors(static_cast<Eigen::Index>(n), 4);
  Eigen::VectorXd known(static_cast<Eigen::Index>(n)), seen(known.size());
  Eigen::Index used = 0;
  for (size_t i = 0; i < n; ++i) {
    const Vector3d p = T_camera_object * nearest->points[i].cast<double>();
    const auto u = camera.project(p);
    if (!u) continue;
    const auto grey = image.mean(*u, static_cast<double>(nearest->side_m) * camera.fx() / p.z());
    if (!grey) continue;
    regressors.row(used) << nearest->normals[i].cast<double>().transpose(), 1;
    known[used] = std::log(kDark + nearest->grey[i]);
    seen[used++] = std::log(kDark + *grey);
  }
  if (used < kFewest) return std::nullopt;
  known = unexplained(regressors.topRows(used), known.head(used));
  seen = unexplained(regressors.topRows(used), seen.head(used));
  const double plain = kPlain * std::sqrt(static_cast<double>(used));
  if (known.norm() < plain) return std::nullopt;
  return known.dot(seen) / (known.norm() * std::max(seen.norm(), plain));
}

bool isPlain(const DatabaseLook& look) {
  const Eigen::Index n = static_cast<Eigen::Index>(look.points.size());
  if (n < kFewest) return true;
  Regressors regressors(n, 4);
  Eigen::VectorXd known(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    regressors.row(i) << look.normals[static_cast<size_t>(i)].cast<double>().transpose(), 1;
    known[i] = std::log(kDark + look.grey[static_cast<size_t>(i)]);
  }
  return unexplained(regressors, known).norm() < kPlain * std::sqrt(static_cast<double>(n));
}

}  // namespace diorama
