// Finding the camera again after a loss: binary descriptors of the keyframes' points, matched with
// the frame, give poses to try.
#pragma once

#include <array>
#include <vector>

#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

class Relocalisation {
 public:
  Relocalisation(const Camera& camera, const VoOptions& options)
      : camera_(camera), options_(options) {}

  // Remembers what the points of a keyframe look like.
  void learn(const Keyframe& keyframe);
  void forgetBadPoints();

  // Poses T_world_camera worth trying, the likeliest first.
  std::vector<SE3> candidates(const TrackedFrame& frame, const TrackedFrame& last,
                              const Map& map) const;

 private:
  static constexpr int kDescriptorBytes = 32;
  using Descriptor = std::array<uint64_t, kDescriptorBytes / 8>;
  struct Entry {
    const MapPoint* point;
    Descriptor descriptor;
  };
  struct Described {
    std::vector<Vector2d> pixels;
    std::vector<Descriptor> descriptors;
    std::vector<size_t> sources;  // index into what was to be described
  };
  static Described describe(const ImagePyramid& pyramid, const std::vector<Vector2d>& pixels,
                            const std::vector<int>& levels);
  std::optional<SE3> fromDescriptors(const TrackedFrame& frame) const;

  const Camera& camera_;
  const VoOptions& options_;
  std::vector<Entry> entries_;
};

}  // namespace diorama::vo
