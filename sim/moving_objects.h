// The moving objects of a frame, as the ray renderer draws them over what rests. Each is a scene in
// its own frame, filmed by the same camera, which moves relative to it.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "sim/direction_box.h"
#include "sim/moving_light.h"
#include "sim/ray_table.h"
#include "sim/row_cameras.h"
#include "sim/sample_pattern.h"

namespace diorama {

// Few, more and many samples: chosen by the motion in the image.
using Patterns = std::array<MovingPattern, 3>;

class MovingObjects {
 public:
  MovingObjects(std::shared_ptr<const RenderScene> scene, const Camera& camera,
                const RayTable& table);
  ~MovingObjects();

  // Places and lights the objects for a frame.
  void begin(const ExposureMotion& motion, WorkerPool& pool);
  // The samples' poses relative to each object; `make` gives the patterns of a motion.
  void preparePatterns(const std::function<Patterns(const ExposureMotion&)>& make);

  bool inTile(int tile) const { return !in_tile_[static_cast<size_t>(tile)].empty(); }
  // The camera relative to each object.
  std::span<const RowCameras> cameras() const { return cameras_; }
  LightView lightAround() const { return light_.around(); }  // on what rests
  LightView lightOf(size_t object) const { return light_.of(object); }
  // The longest way, in pixels, that an object in the tile goes in the image during the exposure.
  double motionInTile(int tile) const;

  // Through the pixel centres of a packet: takes what is nearer than the truth so far.
  struct Centers {
    simd::Float8 t, depth_m;
    simd::Int8 id, mask;
  };
  void traceCenters(int tile, const PacketRays& packet, int y, Centers& centers,
                    simd::Vector8* draft) const;

  // One sample per pixel: the colour of objects that are nearer than t.
  struct SampleChoice {
    size_t pattern;
    bool extra;
    size_t index;
  };
  void drawSample(int tile, const PacketRays& packet, int y, const SampleChoice& choice,
                  simd::Float8 t, simd::Vector8& color) const;

 private:
  struct Object {
    const RenderScene* scene;
    Patterns patterns;
    double way_px = 0;
  };
  void placeInTiles(size_t index, const ExposureMotion& relative);
  ViewCone viewOf(const ExposureMotion& motion) const;
  template <class RaysOf, class Take>
  void nearer(int tile, simd::Int8 valid, simd::Float8& t, const RaysOf& rays_of,
              const Take& take) const;

  std::shared_ptr<const RenderScene> scene_;
  int height_;
  std::vector<DirectionBox> tile_boxes_;
  float pixel_ = 0;           // width of a pixel in directions, at most
  double half_view_rad_ = 0;  // of a cone around all rays
  MovingLight light_;
  std::vector<Object> objects_;
  std::vector<ExposureMotion> motions_;  // of the camera relative to each object
  std::vector<RowCameras> cameras_;
  std::vector<std::vector<size_t>> in_tile_;  // objects
};

}  // namespace diorama
