#include "sim/simulator.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <vector>

#include "core/errors.h"
#include "sim/exposure.h"
#include "sim/jpeg.h"
#include "sim/light_baker.h"
#include "sim/raster_renderer.h"
#include "sim/ray_renderer.h"
#include "sim/sensor.h"
#include "sim/truth_tracer.h"
#include "sim/visible_edges.h"

namespace diorama {
namespace {

// Where samples are cut, in full wells at the image's centre.
constexpr double kSaturation = 1.5;

std::shared_ptr<const RenderScene> makeLitScene(const Scene& scene, const RenderOptions& options) {
  auto result = std::make_shared<RenderScene>(makeRenderScene(scene));
  WorkerPool pool(0);  // baking takes seconds: all cores
  loadOrBakeLight(*result, LightBakerOptions{}, pool, options.before_baking);
  return result;
}

std::unique_ptr<Renderer> makeRenderer(const std::shared_ptr<const RenderScene>& lit,
                                       const Camera& camera, const RenderOptions& options) {
  if (options.renderer == RendererKind::kRaster)
    return std::make_unique<RasterRenderer>(lit, camera, options);
  return std::make_unique<RayRenderer>(lit, camera, options);
}

// The same view with a quarter of the pixels along each side.
Camera meteringCamera(CameraParameters camera) {
  constexpr int kPart = 4;
  camera.width = std::max(1, camera.width / kPart);
  camera.height = std::max(1, camera.height / kPart);
  camera.fx /= kPart;
  camera.fy /= kPart;
  camera.cx = (camera.cx + 0.5) / kPart - 0.5;
  camera.cy = (camera.cy + 0.5) / kPart - 0.5;
  return Camera(camera);
}

ExposureMotion motionAround(const Scene& scene, double middle_s) {
  ExposureMotion motion;
  motion.T_world_camera = [&scene, middle_s](double offset_s) {
    return scene.path->pose(middle_s + offset_s);
  };
  motion.T_world_object = [&scene, middle_s](size_t object, double offset_s) {
    return scene.objects[object].pose(middle_s + offset_s);
  };
  return motion;
}

ExposureControl makeExposure(const Scene& scene, const std::shared_ptr<const RenderScene>& lit) {
  const RayRenderer meter(lit, meteringCamera(scene.camera), {RenderQuality::kDraft, 1});
  return {scene, [&](double time_s) { return meter.render(motionAround(scene, time_s)).radiance; }};
}

}  // namespace

struct Simulator::State {
  State(Scene s, RenderOptions o)
      : scene(std::move(s)),
        camera(scene.camera),
        options(o),
        pool(options.threads),
        lit(makeLitScene(scene, options)),
        exposure(makeExposure(scene, lit)),
        sensor(camera, scene.effects, scene.seed),
        tracer(lit, camera) {
    if (options.truth.edges) edge_tracer.emplace(scene, lit);
  }

  RenderedFrame render(const ExposureMotion& motion);
  ExposureMotion motionDuring(int index) const;
  std::vector<Vector3d> sensorGain(int index) const;
  GroundTruth truthOf(int index, RenderedFrame rendered);
  FlowField flow(int from, int to, const GroundTruth& truth);

  Scene scene;
  Camera camera;
  RenderOptions options;
  WorkerPool pool;
  std::shared_ptr<const RenderScene> lit;
  ExposureControl exposure;
  Sensor sensor;
  TruthTracer tracer;
  std::optional<EdgeTracer> edge_tracer;
  std::mutex mutex;
  std::vector<std::unique_ptr<Renderer>> idle;  // as many as there were callers at once
};

Simulator::Simulator(Scene scene, RenderOptions options)
    : state_(std::make_unique<State>(std::move(scene), options)) {}
Simulator::~Simulator() = default;

const Camera& Simulator::camera() const { return state_->camera; }
int Simulator::frameCount() const { return state_->scene.frameCount(); }
const Scene& Simulator::scene() const { return state_->scene; }

FrameAndTruth Simulator::read(int index) {
  DIORAMA_CHECK(index >= 0 && index < frameCount());
  RenderedFrame rendered = state_->render(state_->motionDuring(index));

  FrameAndTruth result;
  result.frame.index = index;
  result.frame.timestamp_ns = state_->scene.timestampNs(index);
  result.frame.rgb =
      state_->sensor.expose(rendered.radiance, state_->sensorGain(index), index, state_->pool);
  if (const int quality = scene().effects.jpeg_quality; quality > 0)
    result.frame.rgb = throughJpeg(result.frame.rgb, quality);
  result.frame.gray = toGray(result.frame.rgb);
  result.truth = state_->truthOf(index, std::move(rendered));
  return result;
}

FlowField Simulator::flow(int from, int to) {
  DIORAMA_CHECK(from >= 0 && from < frameCount() && to >= 0 && to < frameCount());
  RenderedFrame rendered = state_->render(state_->motionDuring(from));
  GroundTruth truth;
  truth.depth_m = std::move(rendered.depth_m);
  truth.instance_id = std::move(rendered.instance_id);
  return state_->flow(from, to, truth);
}

// A renderer serves one caller at a time.
RenderedFrame Simulator::State::render(const ExposureMotion& motion) {
  std::unique_ptr<Renderer> renderer;
  {
    const std::lock_guard lock(mutex);
    if (!idle.empty()) {
      renderer = std::move(idle.back());
      idle.pop_back();
    }
  }
  if (!renderer) renderer = makeRenderer(lit, camera, options);
  RenderedFrame frame = renderer->render(motion);
  const std::lock_guard lock(mutex);
  idle.push_back(std::move(renderer));
  return frame;
}

ExposureMotion Simulator::State::motionDuring(int index) const {
  ExposureMotion motion = motionAround(scene, scene.time_s(index));
  motion.exposure_s = scene.effects.blur ? scene.exposure_s : 0;
  motion.row_time_s = scene.row_time_s;
  double most_gain = 0;
  for (const Vector3d& gain : sensorGain(index)) most_gain = std::max(most_gain, gain.maxCoeff());
  if (most_gain > 0) motion.brightest = static_cast<float>(kSaturation / most_gain);
  return motion;
}

// Exposure and light, in the middle of the frame or of each row.
std::vector<Vector3d> Simulator::State::sensorGain(int index) const {
  const double middle_s = scene.time_s(index), exposed = exposure.gainAt(middle_s);
  const LightCurve& lighting = scene.effects.lighting;
  if (scene.row_time_s == 0 || lighting.constant()) return {exposed * lighting.at(middle_s)};
  std::vector<Vector3d> gains;
  for (int y = 0; y < camera.height(); ++y)
    gains.push_back(exposed * lighting.at(middle_s + scene.rowOffset_s(y)));
  return gains;
}

GroundTruth Simulator::State::truthOf(int index, RenderedFrame rendered) {
  GroundTruth truth;
  truth.timestamp_ns = scene.timestampNs(index);
  truth.open_ns = truth.timestamp_ns - scene.halfExposureNs();
  truth.close_ns = truth.timestamp_ns + scene.halfExposureNs();
  truth.T_world_camera = scene.T_world_camera(index);
  if (scene.row_time_s > 0)
    for (int y = 0; y < camera.height(); ++y)
      truth.row_poses.push_back(scene.path->pose(scene.time_s(index) + scene.rowOffset_s(y)));
  truth.depth_m = std::move(rendered.depth_m);
  truth.instance_id = std::move(rendered.instance_id);
  size_t next = 0;
  for (const SceneObject& object : scene.objects) {
    if (!object.tracked) continue;
    Silhouette& silhouette = rendered.silhouettes[next++];
    truth.objects.push_back({object.name, object.pose(scene.time_s(index)), silhouette.px_all,
                             silhouette.px_valid, silhouette.px_visible, std::move(silhouette.mask),
                             silhouette.outside});
  }
  if (options.truth.normal)
    truth.normal = tracer.normals(FrameGeometry(scene, camera, index), truth, pool);
  if (edge_tracer) truth.edges = edge_tracer->visible(FrameGeometry(scene, camera, index), pool);
  if (options.truth.flow && index + 1 < scene.frameCount())
    truth.flow = flow(index, index + 1, truth);
  return truth;
}

FlowField Simulator::State::flow(int from, int to, const GroundTruth& truth) {
  FlowField field = tracer.flow(FrameGeometry(scene, camera, from),
                                FrameGeometry(scene, camera, to), truth, pool);
  field.from = from;
  field.to = to;
  return field;
}

}  // namespace diorama
