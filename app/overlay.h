// The picture with the estimated edges, the true ones, and what the estimators say about it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/frame.h"
#include "core/object_model.h"
#include "core/ray_query.h"

namespace diorama {

struct OverlayObject {
  std::optional<SE3> T_camera_object;  // estimated
  std::optional<SE3> T_camera_object_true;
  bool claimed = false;
  std::optional<double> health;
  std::optional<double> visible_fraction;
};

class OverlayPainter {
 public:
  // Objects are numbered as in `rays`.
  OverlayPainter(Camera camera, const std::vector<ObjectModel>& models,
                 std::shared_ptr<const RayQuery> rays);
  ~OverlayPainter();

  // `objects` in the order of the models; `title` stands in the first line.
  Image<Rgb8> paint(const Frame& frame, const std::string& title,
                    const std::vector<OverlayObject>& objects) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace diorama
