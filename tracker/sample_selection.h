// Which samples of the model's edges are looked for in an image: those that are seen and that
// nothing covers, by what the object has looked like so far.
#pragma once

#include <optional>
#include <vector>

#include "tracker/appearance.h"
#include "tracker/edge_search.h"
#include "tracker/region_cue.h"
#include "tracker/surface_look.h"

namespace diorama {

// What is made of parts of the surface that do not look as before. Where the last pose was right
// something covers them. Of a pose that is looked for in the whole image they are evidence against
// it: it would call covered whatever does not fit.
enum class Covers { kIgnored, kAgainstPose, kLeftOut };

class SampleSelection {
 public:
  // All references must outlive this object.
  SampleSelection(const EdgeModel& model, const Mesh& mesh, const Camera& camera,
                  const RayQuery& rays, int object, const EdgeSearch& search,
                  const TrackerOptions& options);

  // The image that the calls below are about; must outlive them.
  void setImage(const EdgePicture& picture, Covers covers);
  // Only samples in this part of the image are used.
  void setPart(const ImagePart& part);

  struct Samples {
    std::vector<int> used;
    double familiar_share = 1;  // of those seen: where the surface looks as it did before
  };
  // The latest answer is kept: several searches start from one pose.
  const Samples& at(const SE3& T_camera_model, int max_samples);

  // Where something covers the object, seen from about this pose; nowhere unless it is left out.
  const CoverMap& coverAt(const SE3& T_camera_model);

  // Where the colours want the outline at those of the samples that are on it; nothing while none
  // are known.
  std::vector<OutlineLikelihood> outlineAt(const SE3& T_camera_model,
                                           const std::vector<int>& samples) const;

  // What the surface and the outline look like, from a pose that is right, and the samples used.
  void learn(const SE3& T_camera_model, const std::vector<int>& samples);

 private:
  Samples select(const SE3& T_camera_model, int max_samples);
  const CoverMap& changedAt(const SE3& T_camera_model);
  const std::vector<SurfaceLook::Sight>& lookFrom(const SE3& T_camera_model, double distance_px);
  void removeUnfamiliar(const SE3& T_camera_model, std::vector<int>& samples) const;
  std::vector<SampleSides> sidesOf(const SE3& T_camera_model, const std::vector<int>& samples,
                                   bool outline_only) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const EdgeSearch& search_;
  const TrackerOptions& options_;
  SurfaceLook surface_;
  OutlineColors colors_;
  std::optional<EdgePicture> picture_;
  ImagePart part_;
  Covers covers_ = Covers::kIgnored;
  std::vector<SurfaceLook::Sight> sights_;  // of the current image, from T_changed_
  CoverMap changed_;                        // parts of it
  std::optional<SE3> T_changed_;
  struct Selected {
    SE3 T_camera_model;
    int max_samples;
    Samples samples;
  };
  std::optional<Selected> selected_;
};

}  // namespace diorama
