// Patches: parts of meshes over which the surface goes on smoothly, and so do its texture
// coordinates. What is known at one point of a patch holds, to first order, a little beside it.
#pragma once

#include "sim/render_scene.h"

namespace diorama {

// Numbers the patches of a scene from 1 on in ShadingTriangle::patch. Triangles belong together
// that share corners (which have one normal and one texture coordinate each) and a material.
void findPatches(RenderScene& scene);

}  // namespace diorama
