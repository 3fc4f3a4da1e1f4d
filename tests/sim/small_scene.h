// A temporary folder with a small scene of two boxes, for tests of what reads and writes files.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "core/errors.h"
#include "core/files.h"
#include "sim/scene.h"

namespace diorama::testing {

inline std::string boxObj(double x, double y, double z) {
  std::string text = "mtllib box.mtl\nusemtl paper\n";
  for (int i = 0; i < 8; ++i)
    text += "v " + std::to_string((i & 1 ? x : -x) / 2) + " " +
            std::to_string((i & 2 ? y : -y) / 2) + " " + std::to_string(i & 4 ? z : 0) + "\n";
  return text + "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

class SmallScene : public ::testing::Test {
 protected:
  void SetUp() override {
    ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("diorama_" + std::string(info->test_suite_name()) + "_" + info->name() + "_" +
               std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
    createFolder(folder_ / "room");
    writeFileAtomically(folder_ / "box.obj", boxObj(0.1, 0.1, 0.24));
    writeFileAtomically(folder_ / "box.mtl", "newmtl paper\nKd 0.8 0.7 0.6\n");
    writeFileAtomically(folder_ / "room/plane.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
    writeFileAtomically(folder_ / "room/environment.yaml",
                        "mesh: plane.obj\nsurfaces: {desk: {z: 0.5, x: [-1, 1], y: [-1, 1]}}\n");
    writeFileAtomically(folder_ / "scene.yaml", yaml());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::string yaml() {
    return R"(seed: 7
camera: {model: radtan, width: 64, height: 48, fx: 50, fy: 51, cx: 31.5, cy: 23.5, distortion: [-0.1, 0.02, 0, 0], rate_hz: 30, exposure_s: 0.008}
duration_s: 0.2
environment: room
path:
  type: spline
  keyframes:
    - {t: 0, position: [1, 0, 0.8], look_at: [0, 0, 0.6]}
    - {t: 0.1, position: [0.9, 0.2, 0.8], look_at: [0, 0, 0.6], roll_rad: 0.1}
    - {t: 0.2, position: [0.8, 0.3, 0.9], quaternion_xyzw: [0.5, 0.5, -0.5, -0.5]}
objects:
  - {name: box, model: box.obj, on: desk, at: [0.1, 0.2], yaw_rad: 0.5, track: true, symmetries: [{axis: [0, 0, 2]}]}
  - {name: other, model: box.obj, T_world_object: {position: [0, 1, 2], quaternion_xyzw: [0, 0, 0, 2]}}
  - {name: small, model: box.obj, scale: 0.5, up: y, on: desk, at: [0.4, 0.2], track: true}
lights:
  - {type: area, center: [0, 0, 2], half_u: [0.2, 0, 0], half_v: [0, -0.2, 0], radiance: [9, 9, 8]}
ambient: 0.1
effects: {noise: false}
odometry: {drift_m_per_m: 0.03}
)";
  }

  std::filesystem::path folder_;
};

// The one line of an error, or what happened instead.
template <class Action>
std::string errorLine(const Action& action, ExitCode expected) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), expected) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

}  // namespace diorama::testing
