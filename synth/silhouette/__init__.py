"""Exact outlines of meshes, and outlines with stated boundary noise: the silhouette tier."""

from synth.silhouette.exact_outline import OutlineMesh, exact_outline, outline_mesh
from synth.silhouette.noisy_outline import noisy_outline

__all__ = ["OutlineMesh", "exact_outline", "noisy_outline", "outline_mesh"]
