// Finds an object by its outline and creases alone: templates of its edges from all around are
// moved over the image's edges.
#pragma once

#include <optional>
#include <vector>

#include "tracker/chamfer_maps.h"
#include "tracker/edge_model.h"
#include "tracker/edge_search.h"
#include "tracker/look_cue.h"

namespace diorama {

class EdgeTemplates {
 public:
  // All references must outlive this object.
  EdgeTemplates(const EdgeModel& model, const Camera& camera, const RayQuery& rays, int object,
                const TrackerOptions& tracker_options, const TemplateOptions& options,
                const std::vector<DatabaseLook>& looks);

  struct Candidate {
    SE3 T_camera_object;
    double ratio = 1;  // distance to the image's edges over what lines of any direction have there
    double score = 1;  // the ratio, less for a good look
  };
  // What is searched.
  struct Sight {
    const ChamferMaps& edges;
    const MeanImage& means;
    // Objects are looked for of which a straight line hides a part: what that costs (PartialLook).
    std::optional<double> part_cost = {};
  };
  // A template at a place of the coarse maps.
  struct Placed {
    size_t view = 0;
    double roll_rad = 0, distance = 0;  // m
    int x = 0, y = 0;                   // cells
    double ratio = 0;                   // as of a candidate, coarsely
  };
  // The places with the smallest ratios, the best first; at most `candidates`.
  std::vector<Placed> place(const ChamferMaps& maps) const;
  // Of these the poses with the best scores, the best first, refined; at most `verified`.
  std::vector<Candidate> choose(const std::vector<Placed>& places, const Sight& sight) const;

  // A pose T_camera_object moved to the image's edges and colours, from further off than the
  // tracker can.
  Candidate refine(const SE3& T_camera_object, const Sight& sight) const;

  // Whether the object's edges are drawn in the same places at two poses, as those of something
  // round are.
  bool areDrawnAlike(const SE3& T_camera_object, const SE3& other) const;

 private:
  struct Point {
    Vector2d offset;  // from the centre's image, for focal length 1 and kViewDistance
    Vector2d normal;
  };
  struct Template {
    SE3 T_camera_model;  // on the optical axis
    std::vector<Point> points;
  };
  struct Scratch {
    std::vector<const uint8_t*>
        places;  // of the template's points in the maps, when it is at (0, 0)
    std::vector<uint8_t> means;
  };

  void addTemplate(const Vector3d& direction, const EdgeSearch& search, const Camera& studio);
  void slide(const ChamferMaps& maps, Placed placed, Scratch& scratch,
             std::vector<Placed>& best) const;
  std::vector<EdgeSearch::Line> draw(const SE3& T_camera_object) const;
  double scoreOf(const SE3& T_camera_object, double ratio, const Sight& sight) const;
  std::optional<SE3> poseOf(const Placed& placed, const ChamferMaps& maps) const;

  const EdgeModel& model_;
  const Camera& camera_;
  const TemplateOptions& options_;
  std::vector<DatabaseLook> looks_, coarse_looks_;  // without points where the object is plain
  std::vector<DatabaseLook> colors_;  // coarse ones of an object that is plain all over
  EdgeSearch search_;
  double diameter_;
  std::vector<Template> templates_;
};

}  // namespace diorama
