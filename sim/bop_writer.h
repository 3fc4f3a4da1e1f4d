// The data set layout of the BOP benchmark (bop_toolkit, docs/bop_datasets_format.md), below `bop/`
// of a sequence: what the toolkit calls the data set "bop" in the sequence's folder.
//
//   bop/camera.json, bop/test_targets_bop19.json
//   bop/models/obj_000001.ply ..., models_info.json      millimetres, Z up
//   bop/test/000000/rgb/FFFFFF.png, depth/, mask/FFFFFF_NNNNNN.png, mask_visib/
//   bop/test/000000/scene_camera.json, scene_gt.json, scene_gt_info.json
//
// Tracked objects are annotated; those that share a model share its obj_id. BOP's cameras have no
// distortion: where ours has one, the pictures show it, and `distortion_model` and
// `distortion_coefficients` stand beside cam_K, which BOP's tools ignore. `timestamp_ns` does too.
#pragma once

#include <vector>

#include "sim/frame_record.h"
#include "sim/sequence_files.h"

namespace diorama {

void writeBopFrame(const EncodedFrame& frame, SequenceFiles& files);

// Everything that is not about one frame alone; `first_frame` is the scene's number of the first
// record.
void writeBopTexts(const Scene& scene, const std::vector<FrameRecord>& records, int first_frame,
                   SequenceFiles& files);

// Largest distance between two of the points.
double largestDistance(const std::vector<Vector3f>& points);

}  // namespace diorama
