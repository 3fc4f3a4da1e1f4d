// The layout of the EuRoC data set (M. Burri et al., IJRR 2016), below `euroc/` of a sequence:
//
//   euroc/mav0/body.yaml
//   euroc/mav0/cam0/{data.csv,sensor.yaml,data/TIMESTAMP.png}         grey
//   euroc/mav0/imu0/{data.csv,sensor.yaml}
//   euroc/mav0/state_groundtruth_estimate0/{data.csv,sensor.yaml}     at the rate of the IMU
//
// Times are whole nanoseconds, quaternions have w first. The body frame is that of the IMU, and the
// IMU sits in the camera: all T_BS are the identity. Camera models have EuRoC's names:
// radial-tangential, or equidistant for a fisheye.
#pragma once

#include <vector>

#include "sim/frame_record.h"
#include "sim/sequence_files.h"

namespace diorama {

void writeEurocFrame(const EncodedFrame& frame, SequenceFiles& files);
void writeEurocTexts(const Scene& scene, const std::vector<FrameRecord>& records,
                     SequenceFiles& files);

}  // namespace diorama
