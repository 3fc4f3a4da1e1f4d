#include "tracker/print.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/image_sampling.h"
#include "tracker/surface_points.h"

namespace diorama {
namespace {

constexpr int kPoints = 6000;         // on the textured surface
constexpr float kLeastContrast = 16;  // levels
constexpr double kSteepest = 0.25;    // cosine between normal and ray
constexpr double kCell = 10;          // px, with one patch at most
constexpr double kStretched = 1;      // px at a patch's rim, from where a plane would have it
constexpr int kSmallest = 16;         // texels, of the last level

constexpr int kLightest = 65535;  // of linear light in 16 bits

double toLinear(double srgb) {  // IEC 61966-2-1
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
double toSrgb(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

// Grey value of a camera with an sRGB curve.
float greyOf(float light) {
  constexpr int kSteps = 4096;
  static const std::vector<float> encoded = [] {
    std::vector<float> table(kSteps + 1);
    for (int i = 0; i <= kSteps; ++i)
      table[static_cast<size_t>(i)] = static_cast<float>(255 * toSrgb(i / double{kSteps}));
    return table;
  }();
  const float at = std::clamp(light / kLightest, 0.f, 1.f) * kSteps;
  const size_t i = std::min<size_t>(static_cast<size_t>(at), kSteps - 1);
  return encoded[i] + (at - static_cast<float>(i)) * (encoded[i + 1] - encoded[i]);
}

// Empty for what is no image.
std::vector<Image<uint16_t>> readLevels(const std::filesystem::path& file) {
  std::vector<Image<uint16_t>> levels;
  cv::Mat bgr;
  if (std::error_code ignored; !std::filesystem::is_regular_file(file, ignored)) return levels;
  try {
    bgr = cv::imread(file.string(), cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
  }
  if (bgr.empty()) return levels;
  cv::Mat table(1, 256, CV_16U), linear;
  for (int i = 0; i < 256; ++i)
    table.at<uint16_t>(i) = static_cast<uint16_t>(std::lround(kLightest * toLinear(i / 255.0)));
  cv::LUT(bgr, table, linear);
  cv::cvtColor(linear, linear, cv::COLOR_BGR2GRAY);
  for (;;) {
    Image<uint16_t>& level = levels.emplace_back(linear.cols, linear.rows);
    for (int y = 0; y < linear.rows; ++y)
      std::copy_n(linear.ptr<uint16_t>(y), linear.cols, level.row(y));
    // An odd last row or column is dropped, as levels elsewhere have it.
    const cv::Size half(linear.cols / 2, linear.rows / 2);
    if (std::min(half.width, half.height) < kSmallest) return levels;
    cv::Mat halved;
    cv::resize(linear(cv::Rect(0, 0, 2 * half.width, 2 * half.height)), halved, half, 0, 0,
               cv::INTER_AREA);
    linear = halved;
  }
}

float lightAt(const Image<uint16_t>& image, const Vector2d& u) {
  const int x = static_cast<int>(u.x()), y = static_cast<int>(u.y());
  const float a = static_cast<float>(u.x() - x), b = static_cast<float>(u.y() - y);
  const uint16_t *p = image.row(y) + x, *q = p + image.width;
  const float top = p[0] + a * static_cast<float>(p[1] - p[0]);
  const float bottom = q[0] + a * static_cast<float>(q[1] - q[0]);
  return top + b * (bottom - top);
}

// Of a patch's window with one pixel more on each side, row by row.
constexpr int kLightSide = Patch::kWindowSide + 2;
using Light = std::array<float, static_cast<size_t>(kLightSide) * kLightSide>;

// at(i, j): texel of the place (i, j) from the middle. False where the texture ends.
template <class At>
bool readLight(const Image<uint16_t>& image, const At& at, Light& light) {
  constexpr int kReach = kLightSide / 2;
  float* next = light.data();
  for (int j = -kReach; j <= kReach; ++j)
    for (int i = -kReach; i <= kReach; ++i) {
      const Vector2d texel = at(i, j);
      if (!(texel.minCoeff() >= 0 && texel.x() < image.width - 1 && texel.y() < image.height - 1))
        return false;
      *next++ = lightAt(image, texel);
    }
  return true;
}

// Grey values behind a lens that blurs by half a pixel.
Patch::Window blurred(const Light& light) {
  constexpr float kBeside = 0.125f, kMiddle = 1 - 2 * kBeside;
  const auto along = [](const float* p, int step) {
    return kBeside * (p[-step] + p[step]) + kMiddle * p[0];
  };
  Light rows{};
  for (int k = 1; k + 1 < static_cast<int>(light.size()); ++k)
    rows[static_cast<size_t>(k)] = along(light.data() + k, 1);
  Patch::Window window;
  float* value = window.data();
  for (int y = 1; y + 1 < kLightSide; ++y)
    for (int x = 1; x + 1 < kLightSide; ++x)
      *value++ = greyOf(along(rows.data() + y * kLightSide + x, kLightSide));
  return window;
}

}  // namespace

double Print::Layout::texelsPerPixel(const Patch& patch) const {
  const Vector2d a = slope * patch.along_x, b = slope * patch.along_y;
  return std::sqrt(std::abs(a.x() * b.y() - a.y() * b.x()));
}

Print::Print(const Mesh& mesh, const Vector3d& centre_object, const Camera& camera,
             const RayQuery& rays, int object)
    : centre_object_(centre_object), camera_(camera), rays_(rays), object_(object) {
  layOut(mesh);
  std::vector<size_t> textured;
  for (size_t t = 0; t < layouts_.size(); ++t)
    if (layouts_[t].texture >= 0) textured.push_back(t);
  for (const SurfacePoint& s : scatterPoints(mesh, textured, kPoints)) {
    Point point{s.p - centre_object_, s.normal, s.triangle};
    point.contrast = contrastAround(point);
    if (point.contrast >= kLeastContrast) points_.push_back(point);
  }
  std::stable_sort(points_.begin(), points_.end(),
                   [](const Point& a, const Point& b) { return a.contrast > b.contrast; });
  complete_ = !textured.empty() && textured.size() == layouts_.size();
}

void Print::layOut(const Mesh& mesh) {
  layouts_.resize(mesh.triangles.size());
  if (mesh.uvs.empty()) return;
  std::map<std::filesystem::path, int> known;
  for (size_t t = 0; t < mesh.triangles.size() && t < mesh.triangle_materials.size(); ++t) {
    const size_t index = static_cast<size_t>(mesh.triangle_materials[t]);
    if (index >= mesh.materials.size() || mesh.materials[index].texture.empty()) continue;
    const Material& material = mesh.materials[index];
    const auto [place, added] = known.try_emplace(material.texture, -1);
    if (added) {
      if (Levels levels = readLevels(material.texture); !levels.empty()) {
        place->second = static_cast<int>(textures_.size());
        textures_.push_back(std::move(levels));
      }
    }
    if (place->second < 0) continue;
    const Image<uint16_t>& texels = textures_[static_cast<size_t>(place->second)].front();
    Matrix3d p;
    Eigen::Matrix<double, 2, 3> texel;
    for (int k = 0; k < 3; ++k) {
      const size_t corner = static_cast<size_t>(mesh.triangles[t][k]);
      p.col(k) = mesh.positions[corner].cast<double>();
      const Vector2d uv = mesh.uvs[corner].cast<double>();
      texel.col(k) << uv.x() * texels.width - 0.5, (1 - uv.y()) * texels.height - 0.5;
    }
    Eigen::Matrix<double, 3, 2> sides;
    sides << p.col(1) - p.col(0), p.col(2) - p.col(0);
    Matrix2d texel_sides;
    texel_sides << texel.col(1) - texel.col(0), texel.col(2) - texel.col(0);
    const Matrix2d square = sides.transpose() * sides;
    if (!(square.determinant() > 0)) continue;
    Layout& layout = layouts_[t];
    layout.slope = texel_sides * square.inverse() * sides.transpose();
    layout.offset = texel.col(0) - layout.slope * p.col(0);
    if (layout.slope.allFinite()) layout.texture = place->second;
  }
}

// By the texels in a square that patches will be about as large as.
float Print::contrastAround(const Point& point) const {
  constexpr double kReach = 0.006;  // m
  constexpr int kSteps = 3;
  const Layout& layout = layouts_[point.triangle];
  const Levels& levels = textures_[static_cast<size_t>(layout.texture)];
  const Vector2d middle = layout.at(point.p + centre_object_);
  const Vector3d a = point.normal.unitOrthogonal(), b = point.normal.cross(a);
  float low = 255, high = 0;
  for (int j = -kSteps; j <= kSteps; ++j)
    for (int i = -kSteps; i <= kSteps; ++i) {
      const Vector2d at = middle + layout.slope * (kReach / kSteps * (i * a + j * b));
      const int x = static_cast<int>(std::lround(at.x())),
                y = static_cast<int>(std::lround(at.y()));
      const Image<uint16_t>& texels = levels.front();
      if (x < 0 || y < 0 || x >= texels.width || y >= texels.height) continue;
      const float grey = greyOf(texels(x, y));
      low = std::min(low, grey);
      high = std::max(high, grey);
    }
  return high - low;
}

// At the level whose texels are about as large as the patch's pixels.
bool Print::read(size_t triangle, const Patch& patch, const Bend& bend,
                 Patch::Window& window) const {
  const Layout& layout = layouts_[triangle];
  const Levels& levels = textures_[static_cast<size_t>(layout.texture)];
  const double finest = std::log2(std::max(layout.texelsPerPixel(patch), 1.0));
  const int level =
      std::min(static_cast<int>(std::lround(finest)), static_cast<int>(levels.size()) - 1);
  const double scale = levelScale(level);
  const Vector2d middle = toLevel(layout.at(patch.p + centre_object_), level);
  const Vector2d x = scale * (layout.slope * patch.along_x + bend.x),
                 y = scale * (layout.slope * patch.along_y + bend.y);
  const Vector2d xx = scale * bend.xx, yy = scale * bend.yy, xy = scale * bend.xy;
  const auto at = [&](int i, int j) -> Vector2d {
    return middle + i * (x + i * xx) + j * (y + j * yy + i * xy);
  };
  Light light;
  if (!readLight(levels[static_cast<size_t>(level)], at, light)) return false;
  window = blurred(light);
  return true;
}

bool Print::isKnown(int triangle) const {
  const size_t t = static_cast<size_t>(triangle);
  return triangle >= 0 && t < layouts_.size() && layouts_[t].texture >= 0;
}

// Nothing where the surface, or the print, does not go on around the patch about as its plane does.
std::optional<Print::Bend> Print::bendAround(const Vector3d& eye, const Point& point,
                                             const Patch& patch) const {
  constexpr double r = Patch::kRadius;
  constexpr std::array<std::array<double, 2>, 8> places{
      {{-r, 0}, {r, 0}, {0, -r}, {0, r}, {-r, -r}, {r, -r}, {-r, r}, {r, r}}};
  std::array<Vector3d, places.size()> on_plane, directions;
  for (size_t k = 0; k < places.size(); ++k) {
    on_plane[k] = patch.p + places[k][0] * patch.along_x + places[k][1] * patch.along_y;
    directions[k] = on_plane[k] - eye;
  }
  const auto hits = rays_.closestHits(object_, eye + centre_object_, directions);
  const Layout& layout = layouts_[point.triangle];
  const double most = kStretched * layout.texelsPerPixel(patch);
  std::array<Vector2d, places.size()> off;
  for (size_t k = 0; k < places.size(); ++k) {
    if (!hits[k] || !isKnown(hits[k]->triangle)) return std::nullopt;
    const Layout& there = layouts_[static_cast<size_t>(hits[k]->triangle)];
    off[k] = there.at(hits[k]->p_object) - layout.at(on_plane[k] + centre_object_);
    if (there.texture != layout.texture || !(off[k].norm() <= most)) return std::nullopt;
  }
  return Bend{(off[1] - off[0]) / (2 * r), (off[3] - off[2]) / (2 * r),
              (off[1] + off[0]) / (2 * r * r), (off[3] + off[2]) / (2 * r * r),
              (off[4] - off[5] - off[6] + off[7]) / (4 * r * r)};
}

std::vector<Patch> Print::patchesSeenFrom(const SE3& T, int most) const {
  const Vector3d eye = T.inverse().translation;
  const Matrix3d R = T.rotationMatrix();
  std::vector<Patch> patches;
  std::vector<Vector2d> taken;
  for (const Point& point : points_) {
    if (patches.size() >= static_cast<size_t>(most)) break;
    const Vector3d ray = eye - point.p;
    if (point.normal.dot(ray) < kSteepest * ray.norm()) continue;
    const auto u = camera_.project(R * point.p + T.translation);
    if (!u || !camera_.contains(*u, Patch::kRadius + 2)) continue;
    const auto near = [&](const Vector2d& other) {
      return (*u - other).lpNorm<Eigen::Infinity>() < kCell;
    };
    if (std::any_of(taken.begin(), taken.end(), near)) continue;
    Patch patch;
    if (!patch.setPlane(point.p, point.normal, camera_, T)) continue;
    const auto bend = bendAround(eye, point, patch);
    Patch::Window window;
    if (!bend || !read(point.triangle, patch, *bend, window) || !patch.setValues(window)) continue;
    taken.push_back(*u);
    patches.push_back(std::move(patch));
  }
  return patches;
}

}  // namespace diorama
