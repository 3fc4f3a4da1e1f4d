#include "sim/euroc_writer.h"

#include "core/text.h"
#include "sim/imu.h"

namespace diorama {
namespace {

const std::string kRoot = "euroc/mav0/";

std::string join(std::initializer_list<Vector3d> vectors) {
  std::string text;
  for (const Vector3d& v : vectors)
    for (int axis : {0, 1, 2}) text += "," + formatNumber(v[axis]);
  return text;
}

std::string identity(const std::string& key) {
  return key +
         ":\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0,\n         0.0, 1.0, 0.0, 0.0,\n"
         "         0.0, 0.0, 1.0, 0.0,\n         0.0, 0.0, 0.0, 1.0]\n";
}

std::string list(const std::vector<double>& numbers) {
  std::string text = "[";
  for (size_t i = 0; i < numbers.size(); ++i) text += (i ? ", " : "") + formatNumber(numbers[i]);
  return text + "]";
}

std::string cameraYaml(const Scene& scene) {
  const CameraParameters& c = scene.camera;
  std::vector<double> distortion = c.distortion;
  distortion.resize(std::max<size_t>(4, distortion.size()));
  return "# General sensor definitions.\nsensor_type: camera\ncomment: simulated, scene " +
         scene.name + "\n\n# Sensor extrinsics wrt. the body-frame.\n" + identity("T_BS") +
         "\n# Camera specific definitions.\nrate_hz: " + formatNumber(scene.rate_hz) +
         "\nresolution: [" + std::to_string(c.width) + ", " + std::to_string(c.height) +
         "]\ncamera_model: pinhole\nintrinsics: " + list({c.fx, c.fy, c.cx, c.cy}) +
         " #fu, fv, cu, cv\ndistortion_model: " +
         (c.model == CameraModel::kFisheye ? "equidistant" : "radial-tangential") +
         "\ndistortion_coefficients: " + list(distortion) + "\n";
}

std::string imuYaml(const Scene& scene) {
  const ImuOptions& imu = scene.imu;
  return "# Default imu sensor yaml file\nsensor_type: imu\ncomment: simulated, scene " +
         scene.name + "\n\n# Sensor extrinsics wrt. the body-frame.\n" + identity("T_BS") +
         "rate_hz: " + formatNumber(imu.rate_hz) +
         "\n\n# inertial sensor noise model parameters (static)\ngyroscope_noise_density: " +
         formatNumber(imu.gyroscope_noise_density) +
         "     # [ rad / s / sqrt(Hz) ]   ( gyro \"white noise\" )\ngyroscope_random_walk: " +
         formatNumber(imu.gyroscope_random_walk) +
         "     # [ rad / s^2 / sqrt(Hz) ] ( gyro bias diffusion )\naccelerometer_noise_density: " +
         formatNumber(imu.accelerometer_noise_density) +
         "     # [ m / s^2 / sqrt(Hz) ]   ( accel \"white noise\" )\naccelerometer_random_walk: " +
         formatNumber(imu.accelerometer_random_walk) +
         "     # [ m / s^3 / sqrt(Hz) ]   ( accel bias diffusion )\n";
}

std::string poseAndQuaternion(const SE3& T) {
  const Eigen::Quaterniond& q = T.rotation;
  std::string text = join({T.translation});
  for (double v : {q.w(), q.x(), q.y(), q.z()}) text += "," + formatNumber(v);
  return text;
}

}  // namespace

void writeEurocFrame(const EncodedFrame& frame, SequenceFiles& files) {
  files.write(kRoot + "cam0/data/" + std::to_string(frame.timestamp_ns) + ".png", frame.grey);
}

void writeEurocTexts(const Scene& scene, const std::vector<FrameRecord>& records,
                     SequenceFiles& files) {
  std::string images = "#timestamp [ns],filename\n";
  for (const FrameRecord& record : records) {
    const std::string time = std::to_string(record.truth.timestamp_ns);
    images += time + "," + time + ".png\n";
  }
  std::string imu =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  std::string truth =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
      "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
      "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]\n";
  for (const ImuSample& sample :
       simulateImu(*scene.path, scene.duration_s, scene.imu, scene.seed,
                   records.front().truth.timestamp_ns, records.back().truth.timestamp_ns)) {
    const std::string time = std::to_string(sample.timestamp_ns);
    imu += time + join({sample.gyroscope, sample.accelerometer}) + "\n";
    truth += time + poseAndQuaternion(sample.T_world_camera) +
             join({sample.velocity, sample.gyroscope_bias, sample.accelerometer_bias}) + "\n";
  }
  files.write(kRoot + "body.yaml", "# General sensor definitions.\ncomment: simulated\n");
  files.write(kRoot + "cam0/data.csv", images);
  files.write(kRoot + "cam0/sensor.yaml", cameraYaml(scene));
  files.write(kRoot + "imu0/data.csv", imu);
  files.write(kRoot + "imu0/sensor.yaml", imuYaml(scene));
  files.write(kRoot + "state_groundtruth_estimate0/data.csv", truth);
  files.write(kRoot + "state_groundtruth_estimate0/sensor.yaml",
              "# General sensor definitions.\nsensor_type: state_groundtruth\ncomment: exact\n\n" +
                  identity("T_BS"));
}

}  // namespace diorama
