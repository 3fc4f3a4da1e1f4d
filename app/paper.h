// What the paper published (P. Singhal, R. White, H. Christensen, Multi-modal tracking for object
// based SLAM), to stand beside our figures. Its sequences are real; ours are scenes made to be like
// them.
#pragma once

#include <array>

namespace diorama {

// In the order of the columns vo (its SVO), ebt, fused; of the camera vo and fused.
struct PaperSequence {
  const char* scene;  // ours
  const char* title;
  std::array<double, 3> error_m, ratio_percent;  // Table 1: mean error and share below 0.5 m
  std::array<double, 2> ate_m;                   // Table 2: mean
};

inline constexpr PaperSequence kPaper[] = {
    {"orange_juice", "orange juice", {0.189, 0.219, 0.192}, {30.10, 21.95, 33.74}, {0.090, 0.119}},
    {"orange_juice_occluded",
     "orange juice, occluded",
     {0.233, 0.257, 0.250},
     {64.43, 75.56, 82.99},
     {0.095, 0.100}},
    {"pasta_box", "pasta box", {0.303, 0.239, 0.274}, {41.37, 23.23, 43.64}, {0.052, 0.117}},
    {"pasta_box_occluded",
     "pasta box, occluded",
     {0.188, 0.215, 0.197},
     {99.09, 94.08, 99.59},
     {0.015, 0.038}},
    {"detergent", "detergent", {0.289, 0.288, 0.282}, {41.97, 30.09, 41.25}, {0.135, 0.115}},
    {"detergent_occluded",
     "detergent, occluded",
     {0.210, 0.293, 0.194},
     {86.89, 53.15, 85.22},
     {0.108, 0.124}},
};

}  // namespace diorama
