#include "tracker/patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr double kSteepest = 0.2;        // cosine between the surface's normal and the ray
constexpr double kWeakestHessian = 500;  // smaller eigenvalue: a patch that would slide
constexpr int kAlignIterations = 6;
constexpr double kFarthest = 6;        // px a patch may lie from where the pose says
constexpr double kSmallestArea = 0.2;  // of a patch pixel's area now against when it was taken

// Grey values around u, where a and b are the steps to the next one. Pixels are read one after the
// other, so that the rest calculates with many at once.
void readPatch(const Image<uint8_t>& image, const Vector2d& u, const Vector2d& a, const Vector2d& b,
               Patch::Values& out) {
  constexpr size_t kWhole = Patch::kWhole;
  static const std::array<Patch::Values, 2> places = [] {
    std::array<Patch::Values, 2> xy;
    for (size_t k = 0; k < kWhole; ++k) {
      const int i = static_cast<int>(std::min(k, Patch::kPixels - 1)), at = static_cast<int>(k);
      xy[0][at] = static_cast<float>(i % Patch::kSide - Patch::kRadius);
      xy[1][at] = static_cast<float>(i / Patch::kSide - Patch::kRadius);
    }
    return xy;
  }();
  const Eigen::Vector2f start = u.cast<float>(), x_step = a.cast<float>(), y_step = b.cast<float>();
  float dx[kWhole], dy[kWhole];
  int pixel[kWhole];
  for (size_t k = 0; k < kWhole; ++k) {
    const float i = places[0].data()[k], j = places[1].data()[k];
    const float x = start.x() + i * x_step.x() + j * y_step.x();
    const float y = start.y() + i * x_step.y() + j * y_step.y();
    const int xi = static_cast<int>(x), yi = static_cast<int>(y);
    pixel[k] = yi * image.width + xi;
    dx[k] = x - static_cast<float>(xi);
    dy[k] = y - static_cast<float>(yi);
  }
  int corners[4][kWhole];
  const uint8_t *const row = image.row(0), *const below = image.row(1);
  for (size_t k = 0; k < kWhole; ++k) {
    corners[0][k] = row[pixel[k]];
    corners[1][k] = row[pixel[k] + 1];
    corners[2][k] = below[pixel[k]];
    corners[3][k] = below[pixel[k] + 1];
  }
  for (size_t k = 0; k < kWhole; ++k) {
    const auto grey = [&](int corner) { return static_cast<float>(corners[corner][k]); };
    const float top = grey(0) + dx[k] * (grey(1) - grey(0));
    const float bottom = grey(2) + dx[k] * (grey(3) - grey(2));
    out.data()[k] = top + dy[k] * (bottom - top);
  }
  out.tail<kWhole - Patch::kPixels>().setZero();
}

}  // namespace

bool Patch::setPlane(const Vector3d& p_model, const Vector3d& normal, const Camera& camera,
                     const SE3& T) {
  const Vector3d p_camera = T * p_model;
  const auto projection = camera.projectWithJacobian(p_camera);
  if (!projection) return false;
  const Matrix3d R = T.rotationMatrix();
  const Vector3d n = R * normal;
  if (std::abs(n.dot(p_camera)) < kSteepest * p_camera.norm()) return false;
  // Steps within the plane, as pixels: its inverse has the pixels' steps.
  Matrix3d seen;
  seen << projection->J, n.transpose();
  const Matrix3d steps = R.transpose() * seen.inverse();
  p = p_model;
  along_x = steps.col(0);
  along_y = steps.col(1);
  return along_x.allFinite() && along_y.allFinite();
}

bool Patch::setValues(const Window& window) {
  const auto value = [&](int x, int y) {
    return window[static_cast<size_t>((y + 1) * kWindowSide + x + 1)];
  };
  for (Values* values : {&grey, &gradient_x, &gradient_y}) values->setZero();
  for (int y = 0, k = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x, ++k) {
      grey[k] = value(x, y);
      gradient_x[k] = 0.5f * (value(x + 1, y) - value(x - 1, y));
      gradient_y[k] = 0.5f * (value(x, y + 1) - value(x, y - 1));
    }
  for (Values* values : {&grey, &gradient_x, &gradient_y})
    values->head<kPixels>() -= values->sum() / kPixels;
  Matrix2d H;
  H(0, 0) = static_cast<double>(gradient_x.square().sum());
  H(1, 1) = static_cast<double>(gradient_y.square().sum());
  H(0, 1) = H(1, 0) = static_cast<double>((gradient_x * gradient_y).sum());
  const double half_trace = H.trace() / 2;
  const double weakest =
      half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - H.determinant()));
  if (weakest < kWeakestHessian) return false;
  inverse_hessian = H.inverse();
  norm = std::sqrt(grey.square().sum());
  return true;
}

void Patch::align(const Image<uint8_t>& image, const Camera& camera, const SE3& T,
                  double smallest_correlation) {
  expected = found = false;
  const Matrix3d R = T.rotationMatrix();
  const auto projection = camera.projectWithJacobian(R * p + T.translation);
  if (!projection) return;
  const Matrix23d J = projection->J * R;
  const Vector2d a = J * along_x, b = J * along_y;
  if (a.x() * b.y() - a.y() * b.x() < kSmallestArea) return;
  const double reach_x = kRadius * (std::abs(a.x()) + std::abs(b.x())) + 1;
  const double reach_y = kRadius * (std::abs(a.y()) + std::abs(b.y())) + 1;
  const Vector2d start = projection->u_px;
  const auto inside = [&](const Vector2d& u) {
    return u.x() >= reach_x && u.y() >= reach_y && u.x() < image.width - 1 - reach_x &&
           u.y() < image.height - 1 - reach_y;
  };
  expected = inside(start);
  Vector2d u = start;
  double correlation = 0;
  Values now;
  for (int iteration = 0; iteration < kAlignIterations; ++iteration) {
    if (!inside(u) || (u - start).norm() > kFarthest) return;
    readPatch(image, u, a, b, now);
    now.head<kPixels>() -= now.sum() / kPixels;
    const float length = std::sqrt(now.square().sum()) + 1e-6f;
    correlation = static_cast<double>((now * grey).sum() / (length * norm));
    const float gain = std::clamp(norm / length, 0.5f, 2.0f);
    const Values error = gain * now - grey;
    const Vector2d step =
        inverse_hessian * Vector2d(static_cast<double>((gradient_x * error).sum()),
                                   static_cast<double>((gradient_y * error).sum()));
    u -= a * step.x() + b * step.y();
    if (step.norm() < 0.02) break;
  }
  found = correlation > smallest_correlation && u.allFinite();
  u_px = u;
}

}  // namespace diorama
