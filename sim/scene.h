// A scene as its YAML file describes it, with every file name resolved and every pose known.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/object_model.h"
#include "core/options.h"
#include "sim/imu.h"
#include "sim/light_curve.h"
#include "sim/motion_path.h"

namespace diorama {

// A rectangle that emits towards half_u x half_v.
struct AreaLight {
  Vector3d center = Vector3d::Zero();  // m, world
  Vector3d half_u = Vector3d::UnitX();
  Vector3d half_v = Vector3d::UnitY();
  Vector3d radiance = Vector3d::Ones();
};

// The instance id of Scene::objects[i] is i + 1; the environment and what is not hit have 0.
struct SceneObject {
  std::string name;                        // [A-Za-z0-9_.-]+, unique: files are named after it
  std::string model;                       // as the scene names it
  std::filesystem::path mesh;              // the file that is imported
  double scale = 1;                        // metres per unit of the file
  bool y_up = false;                       // the file's y axis points up
  SE3 T_world_object;                      // where it rests; at time 0 when it moves
  std::shared_ptr<const MotionPath> path;  // T_world_object over time; null: it rests
  bool tracked = false;                    // known to the estimators
  Symmetries symmetries;

  SE3 pose(double time_s) const { return path ? path->pose(time_s) : T_world_object; }
};

// What the sensor makes of the light that arrives (scene key `effects`), in this order: brightness,
// blur, vignette, exposure, noise, response, 8 bit, JPEG.
struct EffectsOptions {
  LightCurve lighting;     // [[t, gain], ...] or [[t, red, green, blue], ...] of all light
  bool blur = true;        // integrate over the exposure time
  double vignette = 0.15;  // loss of light in the corner, fraction
  // metered: once along the path, so that it looks well; auto: followed over time with a lag; fixed
  std::string exposure = "metered";
  // metered and auto: brighter (> 1) or darker; fixed: parts of the full well per unit of radiance
  double exposure_gain = 1;
  double auto_exposure_s = 0.5;  // time constant of the lag
  bool noise = true;
  double full_well_e = 9000;        // electrons at white: shot noise has their square root
  double read_noise_e = 12;         // electrons, standard deviation
  std::string response = "filmic";  // or srgb, gamma, linear
  double gamma = 2.2;               // of the response `gamma`
  int jpeg_quality = 0;             // 1 to 100: pictures that were coded as JPEG; 0: not
  template <class V>
  void visit(V& v) {
    v("lighting", lighting);
    v("blur", blur);
    v("vignette", vignette, kFraction);
    v("exposure", exposure, {"metered", "auto", "fixed"});
    v("exposure_gain", exposure_gain, Range{1e-6, 1e6});
    v("auto_exposure_s", auto_exposure_s, Range{1e-3, 1e3});
    v("noise", noise);
    v("full_well_e", full_well_e, kPositive);
    v("read_noise_e", read_noise_e, kNotNegative);
    v("response", response, {"filmic", "srgb", "gamma", "linear"});
    v("gamma", gamma, Range{0.1, 10});
    v("jpeg_quality", jpeg_quality, Range{0, 100});
  }
};

// A wheel-and-inertia-like odometry sensor that drifts (scene key `odometry`).
struct SimulatedOdometryOptions {
  double drift_m_per_m = 0.02;  // standard deviation of the translation error over a metre of path
  double drift_rad_per_rad = 0.02;  // of the rotation error over a radian of rotation
  double drift_rad_per_m = 0.01;    // of the rotation error over a metre of path
  double bias_m_per_m = 0.005;      // constant relative error of the length
  double bias_rad_s = 0.0005;       // constant turn rate error
  double noise_m = 0.0002;          // white, per frame
  double noise_rad = 0.0002;
  template <class V>
  void visit(V& v) {
    v("drift_m_per_m", drift_m_per_m, kNotNegative);
    v("drift_rad_per_rad", drift_rad_per_rad, kNotNegative);
    v("drift_rad_per_m", drift_rad_per_m, kNotNegative);
    v("bias_m_per_m", bias_m_per_m, Range{-1, 1});
    v("bias_rad_s", bias_rad_s, Range{-10, 10});
    v("noise_m", noise_m, kNotNegative);
    v("noise_rad", noise_rad, kNotNegative);
  }
};

struct Scene {
  std::string name;   // of the file, without extension
  uint64_t seed = 1;  // of everything random
  CameraParameters camera;
  double rate_hz = 30;
  double exposure_s = 0.008;
  double row_time_s = 0;  // rolling shutter: from one row's exposure to the next one's
  std::shared_ptr<const MotionPath> path;
  double duration_s = 10;
  std::vector<SceneObject> objects;        // the environment's mesh is not among them
  std::filesystem::path environment_mesh;  // empty: none
  std::vector<AreaLight> lights;           // the environment's and the scene's own
  double ambient = 0;                      // radiance of the sky, in all directions
  EffectsOptions effects;
  SimulatedOdometryOptions odometry;
  ImuOptions imu;

  // Frames lie at k / rate_hz, k = 0, 1, ... before duration_s.
  int frameCount() const;
  // Mid-exposure time of a frame, a whole number of microseconds.
  int64_t timestampNs(int frame) const;
  double time_s(int frame) const { return static_cast<double>(timestampNs(frame)) * 1e-9; }
  SE3 T_world_camera(int frame) const;
  // From the opening of the shutter to the timestamp, a whole number of microseconds.
  int64_t halfExposureNs() const;
  // From the frame's timestamp to the middle of the exposure of row y.
  double rowOffset_s(int y) const { return row_time_s * (y - (camera.height - 1) / 2.0); }
};

// Reads a scene file; where there is none of that name, the one in dataFolder(), so that
// `scenes/NAME.yaml` means the same scene from any folder. Models are folders of
// dataFolder()/models or paths relative to the file; an object that lies `on` a surface is imported
// to find its lowest vertex.
// Throws MissingInputError or InputError with file:line:column.
Scene loadScene(const std::filesystem::path& name, const std::vector<YamlOverride>& overrides = {});

// The same from a text; `file` is the name for messages and the place that paths are relative to.
Scene parseScene(const std::string& content, const std::filesystem::path& file,
                 const std::vector<YamlOverride>& overrides = {});

// Every value of the scene as YAML, with SHA-256 sums in place of the camera path and of the model
// files: two scenes with the same text give the same sequence.
std::string describeScene(const Scene& scene);

// The part of it that says what is where at which time, and what the camera can see of it.
std::string describeStage(const Scene& scene);

}  // namespace diorama
