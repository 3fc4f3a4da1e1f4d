// Several odometries at once: the motion to a frame is that of the first one in the list that has
// measured it, so that a second sensor carries on while the better one is lost.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/odometry.h"

namespace diorama {

class OdometryRelay : public Odometry {
 public:
  struct Runner {
    std::string name;
    std::unique_ptr<Odometry> odometry;
  };

  // In the order of preference; at least one.
  explicit OdometryRelay(std::vector<Runner> runners);

  // Only motions from the last frame that has one join up with the way so far: what an odometry
  // measures across its own loss is not used when another one has gone on meanwhile.
  std::optional<OdometryMeasurement> track(const Frame& frame) override;
  bool wantsObjects() const override;
  void leaveOut(std::span<const ObjectMeasurement> moving) override;
  void update(std::span<const ObjectMeasurement> objects) override;
  bool started() const override;
  std::optional<SE3> locate(const std::string& object) const override;
  // Those of all, with their names, and `switched` when another one leads.
  std::vector<OdometryEvent> events() const override;

 private:
  std::vector<Runner> runners_;
  std::optional<int64_t> reached_ns_;  // the newest frame that has a pose
  int64_t now_ns_ = 0;
  std::optional<size_t> leader_;
  std::optional<OdometryEvent> switched_;
};

}  // namespace diorama
