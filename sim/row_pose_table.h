// row_poses.csv: the camera's pose at the time of each row of a rolling shutter.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/se3.h"

namespace diorama {

// Columns: frame,row,timestamp,tx,ty,tz,qx,qy,qz,qw; the rows of a frame stand together, from 0 on.
class RowPoseTable {
 public:
  // Throws MissingInputError; the lines are looked at when they are asked for.
  explicit RowPoseTable(const std::filesystem::path& file);

  // T_world_camera of each row of a frame, by its number in the scene; empty when the frame is not
  // there. Throws InputError with the line.
  std::vector<SE3> rowsOf(int frame, int height) const;

 private:
  struct Place {
    size_t offset;
    int line;
  };
  std::string file_, content_;
  std::map<int, Place> frames_;
};

}  // namespace diorama
