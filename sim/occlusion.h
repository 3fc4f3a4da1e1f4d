// Occluders that are scripted by what they do to the picture: a scene says how much of an object is
// to be seen, and the way that a hand, a board, a pole or a box goes before it is solved for.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/errors.h"
#include "sim/scene.h"

namespace diorama {

// A visible fraction at a time; linear in between.
struct VisibleFraction {
  double time_s = 0;
  double fraction = 1;
};

// Met at every frame from the first to the last time, within kOcclusionTolerance. Before and after
// the occluder comes and goes beside the object, in kApproach_s, and is out of the view otherwise.
struct OcclusionRequest {
  std::string name;                               // of the occluder among the objects of the scene
  std::string model;                              // one of occluderKinds()
  size_t object = 0;                              // index in Scene::objects
  std::vector<VisibleFraction> visible_fraction;  // times increasing
  std::optional<size_t> side;                     // of the kind's sides(); else one that suits
  std::optional<double> distance_m;               // from the camera; else one that suits
  SourcePlace place;                              // for messages
};
// Linear between the times, constant before and after.
double requestedFraction(const OcclusionRequest& request, double time_s);
constexpr double kOcclusionTolerance = 0.02;
constexpr double kApproach_s = 0.8;

// An occluder of models/, and how it comes in.
struct OccluderKind {
  std::string name, model;
  Vector3d middle;  // of the part that hides, in its own frame, m
  // Directions from which it comes, seen by the camera: 0 = right, pi/2 = above.
  std::vector<double> sides_rad;
  bool reaches = false;  // its z axis points the way it goes, as an arm; else it stays upright
  bool passes = false;   // after hiding all it leaves on the other side; else it goes back
};
const std::vector<OccluderKind>& occluderKinds();
// right, left, below ... as scenes name the entries of sides_rad.
std::vector<std::string> sideNames(const OccluderKind& kind);

// Appends one object to the scene for each request. Solved ways are kept in
// cacheFolder()/occlusion. The same scene gives the same ways. Throws InputError at the request's
// place when no way meets the request.
void addOccluders(const std::vector<OcclusionRequest>& requests, Scene& scene);

}  // namespace diorama
