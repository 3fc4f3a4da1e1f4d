#include <cmath>
#include <numbers>

#include "core/errors.h"
#include "core/sha256.h"
#include "tracker/object_database.h"
#include "tracker/view_sphere.h"

namespace diorama {
namespace {

// The surface at a pixel of a view.
std::optional<RayHit> surfaceAt(const RayQuery& rays, int object, const SE3& T_object_camera,
                                const Vector2d& u_px) {
  const auto direction = trainingCamera().unproject(u_px);
  if (!direction) return std::nullopt;
  auto hit =
      rays.closestHit(object, T_object_camera.translation, T_object_camera.rotation * *direction);
  if (hit && hit->normal.dot(hit->p_object - T_object_camera.translation) > 0)
    hit->normal = -hit->normal;
  return hit;
}

// Whether what the descriptor saw is nearly all object: what lies behind it will be another
// background. A pattern of points over the inner half of the window decides.
bool liesOnObject(const RayQuery& rays, int object, const SE3& T_object_camera,
                  const Features::Point& point) {
  constexpr int kDirections = 8, kMayMiss = 2;
  int missed = 0;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = 2 * std::numbers::pi * k / kDirections;
    const Vector2d at =
        point.u_px + 0.5 * point.radius_px * Vector2d(std::cos(angle), std::sin(angle));
    missed += !surfaceAt(rays, object, T_object_camera, at);
  }
  return missed <= kMayMiss;
}

Vector3d centreOf(const Mesh& mesh) {
  return (0.5f * (mesh.minCorner() + mesh.maxCorner())).cast<double>();
}

}  // namespace

const Camera& trainingCamera() {
  // Wide enough for an object of one diameter at 1.5 diameters; OpenCV's focal length of old.
  static const Camera camera{
      CameraParameters{CameraModel::kPinhole, 448, 448, 525, 525, 223.5, 223.5, {}}};
  return camera;
}

std::vector<SE3> trainingViews(const Mesh& mesh, const TrainingOptions& options) {
  const Vector3d centre = centreOf(mesh);
  const double diameter = mesh.diameter();
  const double ratio = options.farthest_diameters / options.nearest_diameters;
  std::vector<SE3> views;
  for (int k = 0; k < options.distances; ++k) {
    const double exponent = options.distances == 1 ? 0 : k / (options.distances - 1.0);
    const double distance = diameter * options.nearest_diameters * std::pow(ratio, exponent);
    for (const Vector3d& direction : sphereDirections(options.views))
      views.push_back(viewFrom(direction, distance, centre));
  }
  return views;
}

std::string meshChecksum(const Mesh& mesh) {
  Sha256 sum;
  const auto bytes = [&](const void* data, size_t size) {
    sum.update({static_cast<const char*>(data), size});
  };
  for (const Vector3f& p : mesh.positions) bytes(p.data(), sizeof(float) * 3);
  for (const Eigen::Vector3i& t : mesh.triangles) bytes(t.data(), sizeof(int) * 3);
  return sum.hexDigest();
}

ObjectDatabase trainDatabase(const ObjectModel& model, const RayQuery& rays, int object_index,
                             const std::function<Frame(int)>& picture,
                             const TrainingOptions& options) {
  ObjectDatabase database;
  database.name = model.name;
  database.mesh_sha256 = meshChecksum(model.mesh);
  database.kind = featureKindFromString(options.features);
  database.views = trainingViews(model.mesh, options);
  const size_t size = static_cast<size_t>(descriptorSize(database.kind));
  for (size_t view = 0; view < database.views.size(); ++view) {
    const SE3 T_object_camera = database.views[view].inverse();
    const Frame frame = picture(static_cast<int>(view));
    const Features features = extractFeatures(frame.gray, database.kind, options.features_per_view);
    for (size_t i = 0; i < features.points.size(); ++i) {
      const Features::Point& point = features.points[i];
      const auto hit = surfaceAt(rays, object_index, T_object_camera, point.u_px);
      if (!hit || !liesOnObject(rays, object_index, T_object_camera, point)) continue;
      database.features.push_back(
          {hit->p_object.cast<float>(), hit->normal.cast<float>(), static_cast<int32_t>(view)});
      const auto row = features.descriptors.begin() + static_cast<std::ptrdiff_t>(i * size);
      database.descriptors.insert(database.descriptors.end(), row,
                                  row + static_cast<std::ptrdiff_t>(size));
    }
    // Of a middle distance: the nearer, the more points; the farther, the less perspective.
    if (static_cast<int>(view) / options.views == options.distances / 2)
      database.looks.push_back(takeLook(frame, trainingCamera(), rays, object_index,
                                        database.views[view], centreOf(model.mesh)));
  }
  return database;
}

}  // namespace diorama
