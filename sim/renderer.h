// What draws a frame: the light that arrives at the sensor, and the truth seen by the same camera.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "core/ground_truth.h"
#include "core/image.h"
#include "core/se3.h"

namespace diorama {

enum class RenderQuality {
  kDraft,     // one sample a pixel, no blur
  kStandard,  // four to sixteen, more on edges
  kHigh       // sixteen and more
};

// Truth beyond depth, ids and silhouettes, which costs time: only what is asked for.
struct TruthChannels {
  bool normal = false;
  bool flow = false;   // to the next frame
  bool edges = false;  // of tracked objects
};

enum class RendererKind { kRay, kRaster };

struct RenderOptions {
  RenderQuality quality = RenderQuality::kStandard;
  int threads = 0;  // 0: as many as the machine has; the picture does not depend on it
  TruthChannels truth = {};
  RendererKind renderer = RendererKind::kRay;
  std::function<void()> before_baking = {};  // of the scene's light, when it must be: for seconds
};

// The camera and the moving objects during one exposure. Times are in seconds from the frame's
// timestamp, which is the middle of the exposure and, with a rolling shutter, of the rows.
struct ExposureMotion {
  std::function<SE3(double)> T_world_camera = {};
  // Of Scene::objects[i], where it moves; may be empty when none does.
  std::function<SE3(size_t, double)> T_world_object = {};
  double exposure_s = 0;  // 0: no blur
  double row_time_s = 0;  // from one row's exposure to the next one's; 0: all rows at once
  // Samples brighter than this count as this bright: beyond the sensor's full well it makes no
  // difference inside a surface, but outlines of lamps and glints would stay jagged.
  float brightest = std::numeric_limits<float>::infinity();

  double rowOffset_s(int y, int height) const { return row_time_s * (y - (height - 1) / 2.0); }
};

struct Radiance {
  float r = 0, g = 0, b = 0;  // linear
  friend bool operator==(const Radiance&, const Radiance&) = default;
};

// One tracked object alone, as if nothing stood before it. Pixel centres are tested, in the middle
// of their row's exposure. px_all counts the pixel grid continued beyond the image, one image's
// width and height to every side; where the camera model ends, the grid goes on with the focal
// length of a pinhole.
struct Silhouette {
  Image<uint8_t> mask;  // inside the image, 0 or 255
  int px_all = 0;
  int px_valid = 0;       // inside the image
  int px_visible = 0;     // not hidden by others
  PixelBox outside = {};  // of the pixels that are counted beyond the image
};

struct RenderedFrame {
  Image<Radiance> radiance;             // mean over pixel area and exposure; black where no ray is
  Image<float> depth_m;                 // Z at the pixel centre; 0 = nothing hit
  Image<uint16_t> instance_id;          // i + 1 for Scene::objects[i], else 0
  std::vector<Silhouette> silhouettes;  // tracked objects, in the order of the scene
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  virtual RenderedFrame render(const ExposureMotion& motion) const = 0;
};

}  // namespace diorama
