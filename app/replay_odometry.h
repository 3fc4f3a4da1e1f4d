// An odometry that was recorded: by the simulated sensor of a sequence, or by somebody else's
// system.
#pragma once

#include <vector>

#include "core/odometry.h"

namespace diorama {

class ReplayOdometry : public Odometry {
 public:
  // Consecutive steps in the order of time; `source` names the odometry in the results.
  ReplayOdometry(std::vector<OdometryMeasurement> steps, std::string source);

  // Composes the steps from the previous frame to this one, whose times may differ by half a
  // millisecond: other programs round. Without a chain of steps between them
  // the measurement has health 0 and the identity.
  std::optional<OdometryMeasurement> track(const Frame& frame) override;

  // Once a step begins in the frame just tracked, or before it.
  bool started() const override;

 private:
  std::vector<OdometryMeasurement> steps_;
  std::string source_;
  std::optional<int64_t> previous_ns_;
};

}  // namespace diorama
