// What is true about one frame. Estimators never see it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/flow_field.h"
#include "core/image.h"
#include "core/mesh_edges.h"
#include "core/se3.h"

namespace diorama {

// Pixels from (x0, y0) to (x1, y1), both included; empty as it is made.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = -1, y1 = -1;

  bool empty() const { return x1 < x0; }
  void add(int x, int y) {
    *this = empty() ? PixelBox{x, y, x, y}
                    : PixelBox{std::min(x0, x), std::min(y0, y), std::max(x1, x), std::max(y1, y)};
  }
  void add(const PixelBox& other) {
    if (other.empty()) return;
    add(other.x0, other.y0);
    add(other.x1, other.y1);
  }
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

struct ObjectTruth {
  std::string name;
  SE3 T_world_object;
  // Pixels of the object's whole silhouette, also beyond the image border; those inside the image;
  // those that are seen. -1 = not known.
  int px_all = -1;
  int px_valid = -1;
  int px_visible = -1;
  Image<uint8_t> mask;    // amodal silhouette inside the image, 0 or 255; may be empty
  PixelBox outside = {};  // of those pixels of the silhouette that lie beyond the image

  // Seen over all pixels of the silhouette (BOP's visib_fract); nothing when not known.
  std::optional<double> visibleFraction() const {
    if (px_all < 0) return std::nullopt;
    return px_all == 0 ? 0.0 : static_cast<double>(px_visible) / px_all;
  }
};

// Of the surface in a pixel: unit, in the camera frame, towards the camera; 0 where nothing is hit.
struct Normal {
  float x = 0, y = 0, z = 0;
  friend bool operator==(const Normal&, const Normal&) = default;
};

// A part of a model edge that is seen.
struct VisibleEdge {
  int object = 0;  // in GroundTruth::objects
  int edge = 0;    // in the MeshEdges of its mesh
  EdgeKind kind = EdgeKind::kSharp;
  std::vector<Vector2d> line_px;  // at least two vertices
};

struct GroundTruth {
  int64_t timestamp_ns = 0;           // mid-exposure
  int64_t open_ns = 0, close_ns = 0;  // of the shutter, middle row
  SE3 T_world_camera;                 // mid-exposure, mid-row
  std::vector<SE3> row_poses;         // T_world_camera of each row; empty: that of the frame
  std::vector<ObjectTruth> objects;   // tracked objects, in the order of the scene
  // At exact pixel centres, from the same rays as the picture; may be empty (a sequence without
  // them).
  Image<float> depth_m;         // Z in the camera frame; 0 = nothing hit
  Image<uint16_t> instance_id;  // 0 = background; ids as in instances.csv
  // Only when asked for.
  Image<Normal> normal;
  std::optional<FlowField> flow;  // to the next frame; none from the scene's last one
  std::optional<std::vector<VisibleEdge>> edges;
};

}  // namespace diorama
