// Views of an object from all around.
#pragma once

#include <vector>

#include "core/se3.h"

namespace diorama {

// Unit vectors spread evenly over the sphere (a Fibonacci lattice: Gonzalez, Measurement of areas
// on a sphere, Math. Geosci. 2010).
std::vector<Vector3d> sphereDirections(int count);

// T_camera_object of a camera in the given direction from the centre, at a distance (m), looking
// at the centre, with the object's z upwards in the image, or y when it looks along z.
SE3 viewFrom(const Vector3d& direction, double distance, const Vector3d& centre_object);

}  // namespace diorama
