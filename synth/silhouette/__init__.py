"""Outlines of meshes: exact, with stated boundary noise, or those of blurred pictures."""

from synth.silhouette.coverage import Grid, blurred, grid_around, level_outline, mean_coverage, quantile_coverage
from synth.silhouette.exact_outline import OutlineMesh, contour_edges, exact_outline, outline_mesh
from synth.silhouette.noisy_outline import noisy, noisy_outline

__all__ = [
    "Grid",
    "OutlineMesh",
    "blurred",
    "contour_edges",
    "exact_outline",
    "grid_around",
    "level_outline",
    "mean_coverage",
    "noisy",
    "noisy_outline",
    "outline_mesh",
    "quantile_coverage",
]
