// Truth beyond poses, depth and masks as files of a sequence: normals, optical flow, and the tables
// edges.csv, exposures.csv and row_poses.csv.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/ground_truth.h"
#include "core/image.h"
#include "sim/scene.h"

namespace diorama {

// (n + 1) / 2 in 8 bits; black where there is no surface.
Image<Rgb8> toPicture(const Image<Normal>& normal);

// KITTI's: red and green are 64 * flow + 2^15, blue is 1 where the point is seen in the other
// frame. The flow is written wherever the point projects and the format can hold it (512 px), also
// where blue is 0; else red and green are 0.
inline constexpr float kFlowScale = 64, kFlowZero = 32768;
Image<Rgb16> toPicture(const FlowField& flow);

struct NamedFile {
  std::string name;  // relative to the sequence
  std::string content;
};

// The channels of `truth` that are there, and the frame's lines of the tables, which lie in the
// folder `parts` until joinTables().
std::vector<NamedFile> truthFiles(int frame, const GroundTruth& truth, const Scene& scene,
                                  const std::string& parts);

struct HashedFile {
  std::string name;
  std::string sha256;
};

// Makes the tables from the parts of the frames [first, end), of which only one is in memory at a
// time. Tables without parts are not made.
std::vector<HashedFile> joinTables(const std::filesystem::path& folder, const std::string& parts,
                                   int first, int end);

// exposures.csv: when the shutter opens and closes, in the middle row.
std::string exposureTable(const Scene& scene, int first, int end);

}  // namespace diorama
