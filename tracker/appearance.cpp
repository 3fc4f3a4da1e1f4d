#include "tracker/appearance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace diorama {
namespace {

constexpr int kGrid_px = 5;      // distance of the points in a picture of the training
constexpr int kFewest = 24;      // points for a comparison
constexpr float kDark = 10;      // grey levels: below them the logarithm is mostly noise
constexpr double kPlain = 0.05;  // standard deviation of logarithms; with less there is no print
constexpr double kLight = 0.15;  // ... of what light does beyond the normals: reflections, shadows

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

// log(kDark + value) of quarters of grey levels.
float logarithm(float value) {
  static const std::array<float, 1024> table = [] {
    std::array<float, 1024> t{};
    for (size_t i = 0; i < t.size(); ++i) t[i] = std::log(kDark + 0.25f * static_cast<float>(i));
    return t;
  }();
  return table[static_cast<size_t>(std::clamp(4 * value + 0.5f, 0.0f, 1023.0f))];
}

Vector3f toVector(const Rgb8& c) {
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)};
}

double plainSquares(int points) { return kPlain * kPlain * points; }

// Logarithm of how much likelier a difference of colour is for the object's own, which light
// changes, than for any other; standard deviations.
struct OtherColor {
  double own, any;
  double operator()(double difference) const {
    return std::log(any / own) -
           0.5 * difference * difference * (1 / (own * own) - 1 / (any * any));
  }
};

// Sums over points, from which the parts of two pictures come out that their normals do not
// explain.
class Comparison {
 public:
  void add(const Vector3f& normal, const Vector3f& known, const Vector3f& seen) {
    const Eigen::Vector4f n(normal.x(), normal.y(), normal.z(), 1);
    normals_ += n * n.transpose();
    known_ += n * known.transpose();
    seen_ += n * seen.transpose();
    known_known_ += known.squaredNorm();
    seen_seen_ += seen.squaredNorm();
    known_seen_ += known.dot(seen);
    ++points_;
  }
  int points() const { return points_; }

  // Sums of squares and of products of what the best linear combination of the normals leaves.
  // Those of a flat side depend on one another, hence the ridge.
  struct Left {
    double known, seen, both;
  };
  Left left() const {
    constexpr double kRidge = 1e-6;
    const Eigen::Matrix4d ridge = kRidge * points_ * Eigen::Matrix4d::Identity();
    const Eigen::LDLT<Eigen::Matrix4d> solver(normals_.cast<double>() + ridge);
    const Coefficients known = known_.cast<double>(), seen = seen_.cast<double>();
    const Coefficients by_known = solver.solve(known), by_seen = solver.solve(seen);
    return {known_known_ - known.cwiseProduct(by_known).sum(),
            seen_seen_ - seen.cwiseProduct(by_seen).sum(),
            known_seen_ - known.cwiseProduct(by_seen).sum()};
  }

  // The correlation of what is left; nothing when there are too few points, or no print.
  std::optional<double> agreement() const {
    if (points_ < kFewest) return std::nullopt;
    const Left squares = left();
    const double plain = plainSquares(points_);
    if (squares.known < plain) return std::nullopt;
    return squares.both / std::sqrt(squares.known * std::max(squares.seen, plain));
  }

 private:
  using Coefficients = Eigen::Matrix<double, 4, 3>;
  Eigen::Matrix4f normals_ = Eigen::Matrix4f::Zero();
  Eigen::Matrix<float, 4, 3> known_ = Eigen::Matrix<float, 4, 3>::Zero(), seen_ = known_;
  float known_known_ = 0, seen_seen_ = 0, known_seen_ = 0;
  int points_ = 0;
};

}  // namespace

MeanImage::MeanImage(const Frame& frame)
    : width_(frame.gray.width),
      height_(frame.gray.height),
      channels_(frame.rgb.width == width_ && frame.rgb.height == height_ ? 3 : 1),
      sums_(static_cast<size_t>(channels_) * static_cast<size_t>(width_ + 1) *
                static_cast<size_t>(height_ + 1),
            0) {
  if (channels_ == 3)
    sumUp([&](int x, int y) {
      const Rgb8& c = frame.rgb(x, y);
      return std::array<uint8_t, 3>{c.r, c.g, c.b};
    });
  else
    sumUp([&](int x, int y) { return std::array<uint8_t, 1>{frame.gray(x, y)}; });
  constexpr int kSide = 8;
  int squares = 0;
  for (int y = kSide / 2; y < height_; y += kSide)
    for (int x = kSide / 2; x < width_; x += kSide)
      if (const auto color = mean(Vector2d(x, y), kSide)) {
        brightness_ += lookValue(*color, hasColors())[0];
        ++squares;
      }
  if (squares > 0) brightness_ /= static_cast<float>(squares);
}

template <class ValueAt>
void MeanImage::sumUp(const ValueAt& value_at) {
  constexpr size_t n = std::tuple_size_v<decltype(value_at(0, 0))>;
  const size_t stride = n * (static_cast<size_t>(width_) + 1);
  for (int y = 0; y < height_; ++y) {
    std::array<uint32_t, n> row{};
    const uint32_t* above = sums_.data() + static_cast<size_t>(y) * stride + n;
    uint32_t* sum = sums_.data() + static_cast<size_t>(y + 1) * stride + n;
    for (int x = 0; x < width_; ++x, above += n, sum += n) {
      const auto value = value_at(x, y);
      for (size_t c = 0; c < n; ++c) sum[c] = above[c] + (row[c] += value[c]);
    }
  }
}

std::optional<Vector3f> MeanImage::mean(const Vector2d& u_px, double side_px) const {
  const int side = std::clamp(static_cast<int>(std::lround(side_px)), 1, width_ + height_);
  const double left = std::floor(u_px.x() - 0.5 * side + 1),
               top = std::floor(u_px.y() - 0.5 * side + 1);
  if (!(left >= 0 && top >= 0 && left + side <= width_ && top + side <= height_))
    return std::nullopt;
  const size_t channels = static_cast<size_t>(channels_),
               stride = channels * (static_cast<size_t>(width_) + 1),
               n = channels * static_cast<size_t>(side);
  const uint32_t* const a =
      sums_.data() + static_cast<size_t>(top) * stride + channels * static_cast<size_t>(left);
  const uint32_t* const b = a + static_cast<size_t>(side) * stride;
  const float scale = 1 / (static_cast<float>(side) * static_cast<float>(side));
  // Modulo 2^32 on the way.
  const auto of = [&](size_t c) {
    return scale * static_cast<float>(b[n + c] - b[c] - a[n + c] + a[c]);
  };
  return channels_ == 3 ? Vector3f(of(0), of(1), of(2)) : Vector3f::Constant(of(0)).eval();
}

DatabaseLook takeLook(const Frame& picture, const Camera& camera, const RayQuery& rays,
                      int object_index, const SE3& T_camera_object, const Vector3d& centre_object) {
  const SE3 T_object_camera = T_camera_object.inverse();
  const Vector3d eye = T_object_camera.translation;
  const MeanImage means(picture);
  DatabaseLook look;
  look.direction = (eye - centre_object).normalized().cast<float>();
  look.side_m = static_cast<float>(kGrid_px * (eye - centre_object).norm() / camera.fx());
  for (int y = kGrid_px; y < picture.gray.height - kGrid_px; y += kGrid_px)
    for (int x = kGrid_px; x < picture.gray.width - kGrid_px; x += kGrid_px) {
      const Vector2d u(x, y);
      const auto direction = camera.unproject(u);
      if (!direction) continue;
      const auto hit = rays.closestHit(object_index, eye, T_object_camera.rotation * *direction);
      if (!hit || !squareOnObject(camera, rays, object_index, T_object_camera, u)) continue;
      const auto color = means.mean(u, kGrid_px);
      if (!color) continue;
      const auto toByte = [](float v) { return static_cast<uint8_t>(std::lround(v)); };
      look.points.push_back(hit->p_object.cast<float>());
      look.normals.push_back(hit->normal.cast<float>());
      look.colors.push_back({toByte((*color)[0]), toByte((*color)[1]), toByte((*color)[2])});
    }
  return look;
}

Vector3f lookValue(const Vector3f& rgb, bool has_colors) {
  const float brightness = logarithm(0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2]);
  if (!has_colors) return {brightness, 0, 0};
  const float green = logarithm(rgb[1]);
  return {brightness, logarithm(rgb[0]) - green, logarithm(rgb[2]) - green};
}

Vector3f lookValue(const Rgb8& color, bool has_colors) {
  return lookValue(toVector(color), has_colors);
}

// Points of one cell of a grid in space are a patch, when they fill it.
DatabaseLook coarser(const DatabaseLook& look) {
  constexpr float kRatio = 2;
  constexpr int kFewestOfCell = 2;
  struct Cell {
    Vector3f point = Vector3f::Zero(), normal = point, color = point;
    int count = 0;
  };
  DatabaseLook coarse;
  coarse.direction = look.direction;
  coarse.side_m = kRatio * look.side_m;
  std::map<std::array<int, 3>, Cell> cells;
  for (size_t i = 0; i < look.points.size(); ++i) {
    const Vector3f at = (look.points[i] / coarse.side_m).array().round();
    Cell& cell = cells[{static_cast<int>(at[0]), static_cast<int>(at[1]), static_cast<int>(at[2])}];
    cell.point += look.points[i];
    cell.normal += look.normals[i];
    cell.color += toVector(look.colors[i]);
    ++cell.count;
  }
  for (const auto& [at, cell] : cells) {
    if (cell.count < kFewestOfCell || cell.normal.norm() < 0.5f * static_cast<float>(cell.count))
      continue;
    const float n = static_cast<float>(cell.count);
    coarse.points.push_back(cell.point / n);
    coarse.normals.push_back(cell.normal.normalized());
    const Vector3f color = (cell.color / n).array().round();
    coarse.colors.push_back({static_cast<uint8_t>(color[0]), static_cast<uint8_t>(color[1]),
                             static_cast<uint8_t>(color[2])});
  }
  return coarse;
}

const DatabaseLook& nearestLook(const std::vector<DatabaseLook>& looks, const SE3& T_camera_object,
                                const Vector3d& centre_object) {
  const Vector3f side =
      (T_camera_object.inverse().translation - centre_object).normalized().cast<float>();
  const auto nearest = std::max_element(looks.begin(), looks.end(),
                                        [&](const DatabaseLook& a, const DatabaseLook& b) {
                                          return a.direction.dot(side) < b.direction.dot(side);
                                        });
  static const DatabaseLook nothing;
  return nearest == looks.end() ? nothing : *nearest;
}

namespace {

// What is known of a point of a look, and what is seen of it.
struct SeenPoint {
  Vector2d u_px;
  Vector3f normal, known, seen;
};

std::vector<SeenPoint> pointsIn(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                const Camera& camera, const SE3& T_camera_object,
                                const Vector3d& centre_object, int most_points) {
  const Vector3d eye = T_camera_object.inverse().translation;
  const DatabaseLook& nearest = nearestLook(looks, T_camera_object, centre_object);
  const Matrix3d R = T_camera_object.rotationMatrix();
  const size_t n = nearest.points.size(), most = static_cast<size_t>(std::max(1, most_points));
  const size_t step = (n + most - 1) / most;
  std::vector<SeenPoint> points;
  for (size_t i = 0; i < n; i += step) {
    const Vector3d place = nearest.points[i].cast<double>();
    const Vector3d p = R * place + T_camera_object.translation;
    const Vector3f& normal = nearest.normals[i];
    if ((eye - place).dot(normal.cast<double>()) <= 0) continue;  // turned away
    const auto u = camera.project(p);
    if (!u) continue;
    const auto color = image.mean(*u, static_cast<double>(nearest.side_m) * camera.fx() / p.z());
    if (!color) continue;
    points.push_back({*u, normal, lookValue(nearest.colors[i], image.hasColors()),
                      lookValue(*color, image.hasColors())});
  }
  return points;
}

}  // namespace

std::optional<double> compareLooks(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                   const Camera& camera, const SE3& T_camera_object,
                                   const Vector3d& centre_object, int most_points) {
  Comparison comparison;
  for (const SeenPoint& p :
       pointsIn(looks, image, camera, T_camera_object, centre_object, most_points))
    comparison.add(p.normal, p.known, p.seen);
  return comparison.agreement();
}

PartialLook compareLooksInPart(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                               const Camera& camera, const SE3& T_camera_object,
                               const Vector3d& centre_object, double cost, int most_points) {
  constexpr int kDirections = 16, kSteps = 10;
  std::vector<SeenPoint> points =
      pointsIn(looks, image, camera, T_camera_object, centre_object, most_points);
  PartialLook best{compareLooks(looks, image, camera, T_camera_object, centre_object, most_points)};
  double best_score = best.agreement.value_or(-1);
  const size_t n = points.size();
  for (int k = 0; k < kDirections && n > 0; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const Vector2d along(std::cos(angle), std::sin(angle));
    std::sort(points.begin(), points.end(), [&](const SeenPoint& a, const SeenPoint& b) {
      return along.dot(a.u_px) < along.dot(b.u_px);
    });
    Comparison comparison;
    for (size_t i = 0; i + 1 < n; ++i) {
      comparison.add(points[i].normal, points[i].known, points[i].seen);
      const bool judged = 2 * (i + 1) >= n && (i + 1) * kSteps / n != (i + 2) * kSteps / n;
      if (!judged) continue;
      const double share = static_cast<double>(i + 1) / static_cast<double>(n);
      const std::optional<double> agreement = comparison.agreement();
      const double score = agreement.value_or(-1) - cost * (1 - share);
      if (score <= best_score) continue;
      best_score = score;
      best = {agreement, share, {along, 0.5 * along.dot(points[i].u_px + points[i + 1].u_px)}};
    }
  }
  return best;
}

std::optional<double> compareColors(const std::vector<DatabaseLook>& looks, const MeanImage& image,
                                    const Camera& camera, const SE3& T_camera_object,
                                    const Vector3d& centre_object, int most_points) {
  constexpr float kTrained = 4.6f;  // brightness of an image in the light of the training
  constexpr double kWorst = -2;     // a reflection is no contradiction
  constexpr OtherColor shade{0.4, 0.8}, tint{0.15, 0.45};
  if (!image.hasColors()) return std::nullopt;
  const std::vector<SeenPoint> points =
      pointsIn(looks, image, camera, T_camera_object, centre_object, most_points);
  if (points.size() < size_t{kFewest}) return std::nullopt;
  double sum = 0;
  for (const SeenPoint& p : points) {
    const Vector3d difference = (p.seen - p.known).cast<double>();
    double ratio = shade(difference[0] - static_cast<double>(image.brightness() - kTrained));
    ratio += tint(difference[1]) + tint(difference[2]);
    sum += std::max(kWorst, ratio);
  }
  return sum / static_cast<double>(points.size()) / (shade(0) + 2 * tint(0));
}

namespace {

bool hasLessPrint(const DatabaseLook& look, double deviation) {
  Comparison comparison;
  for (size_t i = 0; i < look.points.size(); ++i) {
    const Vector3f known = lookValue(look.colors[i]);
    comparison.add(look.normals[i], known, known);
  }
  return comparison.points() < kFewest ||
         comparison.left().known < deviation * deviation * comparison.points();
}

}  // namespace

bool isPlain(const DatabaseLook& look) { return hasLessPrint(look, kPlain); }

bool arePlain(const std::vector<DatabaseLook>& looks) {
  return std::all_of(looks.begin(), looks.end(),
                     [](const DatabaseLook& look) { return hasLessPrint(look, kLight); });
}

}  // namespace diorama
