"""Generator of the CAD models, textures and environment in this folder."""
