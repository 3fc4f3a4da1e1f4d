// The renderer's rays against OpenCV's camera model.
#include "sim/ray_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

namespace diorama {
namespace {

// Every pixel of the image, in the single precision that rays have.
TEST(RayTable, RaysProjectBackToTheirPixels) {
  for (const CameraParameters& k :
       {CameraParameters{CameraModel::kRadTan,
                         640,
                         480,
                         522.7,
                         523.4,
                         318.6,
                         243.1,
                         {-0.11, 0.045, 0.0006, -0.0004}},
        CameraParameters{CameraModel::kRadTan,
                         640,
                         480,
                         420,
                         425,
                         322,
                         237,
                         {0.26, -0.45, -0.0054, 0.0026, 0.16}},
        CameraParameters{
            CameraModel::kFisheye, 640, 480, 300, 302, 322, 237, {0.02, -0.01, 0.004, -0.001}}}) {
    const RayTable table{Camera(k)};
    std::vector<cv::Point3d> rays;
    std::vector<cv::Point2d> pixels, projected;
    for (int tile = 0; tile < table.tileCount(); ++tile)
      for (int p = 0; p < kPacketsPerTile; ++p)
        for (int lane = 0; lane < 8; ++lane) {
          const PacketRays& packet = table.packet(tile, p);
          if (!(packet.valid >> lane & 1)) continue;
          rays.emplace_back(packet.x[lane], packet.y[lane], 1);
          pixels.emplace_back(table.packetX(tile, p) + laneX(lane),
                              table.packetY(tile, p) + laneY(lane));
        }
    ASSERT_EQ(rays.size(), 640u * 480u);
    const cv::Mat matrix = (cv::Mat_<double>(3, 3) << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1);
    const cv::Vec3d zero(0, 0, 0);
    if (k.model == CameraModel::kFisheye)
      cv::fisheye::projectPoints(rays, projected, zero, zero, matrix, k.distortion);
    else
      cv::projectPoints(rays, zero, zero, matrix, k.distortion, projected);
    double worst_px = 0;
    for (size_t i = 0; i < rays.size(); ++i)
      worst_px = std::max(worst_px, cv::norm(projected[i] - pixels[i]));
    EXPECT_LT(worst_px, 1e-3);
  }
}

}  // namespace
}  // namespace diorama
