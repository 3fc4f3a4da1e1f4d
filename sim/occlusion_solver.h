// Solves for the way of an occluder that leaves a requested part of an object visible.
#pragma once

#include <string>

#include "sim/occlusion_path.h"
#include "sim/occlusion_view.h"
#include "sim/worker_pool.h"

namespace diorama {

struct OcclusionSolution {
  OccluderTrack track;
  std::string problem;  // empty when solved; else why no way was found
};

// Tries distances from far to near and the sides of the kind, and takes the first way that meets
// the request in every frame and stays clear of everything. Deterministic.
OcclusionSolution solveOcclusion(const OcclusionRequest& request, const OccluderKind& kind,
                                 const Mesh& occluder, const Scene& scene,
                                 const ObjectViewer& viewer, WorkerPool& pool);

}  // namespace diorama
