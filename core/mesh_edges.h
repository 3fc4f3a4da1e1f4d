// The edges of a mesh that can show in an image.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace diorama {

enum class EdgeKind {
  kBoundary,  // one face: always shows
  kSharp,     // two faces at a fold, or more than two faces: always shows
  kSmooth     // shows where it lies on the silhouette: one face towards the camera, one away
};

struct MeshEdge {
  int a = 0, b = 0;  // vertices
  Vector3d n1, n2;   // unit normals of its faces, oriented alike; equal on a boundary
  EdgeKind kind = EdgeKind::kSharp;
};

struct MeshEdgeOptions {
  // An edge between two faces is sharp when |n1 . n2| is at most this (a dihedral between 25.8 and
  // 154.2 degrees, Choi and Christensen 2012) ...
  double sharp_cosine = 0.9;
  // ... unless the mesh's own normals run on smoothly across it: then its faces stand for a round
  // surface, however few they are. Of folds beyond this that is not believed: boxes are often
  // exported with one normal per corner. And a round of a small radius, in model diameters, looks
  // like the edge that it softens.
  double rounded_cosine = 0.5;
  double rounded_radius = 0.02;
  // Smooth edges between faces flatter than this cannot be told from a plane and are dropped.
  double flat_cosine = 0.99999;
  double weld_tolerance = 1e-4;  // vertices nearer than this, in model diameters, are one
};

struct MeshEdges {
  Vector3d centre_object = Vector3d::Zero();  // of the bounding box, m, object frame
  std::vector<Vector3d> vertices;             // welded, from that centre
  std::vector<MeshEdge> edges;                // in the order of their vertices
};

// Welds vertices (a textured mesh repeats them along seams), drops degenerate and repeated faces
// and flat edges. No edges when the mesh has no face or no size.
MeshEdges findMeshEdges(const Mesh& mesh, const MeshEdgeOptions& options = {});

}  // namespace diorama
