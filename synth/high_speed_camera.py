"""The high-speed camera that a recipe states."""

import numpy as np

from datasets.recipes.recipe import HsvRecipe
from datasets.vocabulary.camera import HsvCamera, Intrinsics


def hsv_camera(recipe: HsvRecipe) -> HsvCamera:
    """The high-speed camera; its principal distance is that of a thin lens focused at ``distance_m``: ``f d / (d - f)``."""
    f, d = recipe.focal_mm * 1e-3, recipe.distance_m
    pitch = recipe.pixel_pitch_um * 1e-6
    focal_px = f * d / (d - f) / pitch
    cx = (recipe.width_px - 1) / 2 + recipe.principal_point_offset_px[0]
    cy = (recipe.height_px - 1) / 2 + recipe.principal_point_offset_px[1]
    intrinsics = Intrinsics(recipe.width_px, recipe.height_px, focal_px, focal_px, cx, cy, recipe.distortion, pitch)
    return HsvCamera("hsv", intrinsics, np.eye(3), np.zeros(3))
