"""Edges of a picture moved as a segmentation would draw them.

Where an effect displaces outlines, a picture is bent near the edge of the particle: with ``phi`` the signed distance to the outline at half
coverage, ``phi'`` that to the displaced one and ``u`` the gradient of ``phi``, the new picture at ``p`` is the old one at ``p - (phi -
phi') u``. So the profile of the edge stays and its place changes. Beyond ``BAND_PX`` of the edge nothing moves; valid for displacements
well below that.
"""

from collections.abc import Callable

import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from synth.rendering.tracer import Traced
from synth.rendering.window import Window, pixel_grid
from synth.silhouette import Grid, level_outline

Array = NDArray[np.float64]

BAND_PX = 8.0
HALF = 0.5


def redrawn(traced: Traced, window: Window, reshape: Callable[[Array], Array]) -> Traced:
    """The particle's picture with its outline (px) reshaped; unchanged where it shows no closed outline."""
    try:
        outline = level_outline(traced.coverage, Grid(np.array([window.x0, window.y0]) - 0.5, 1, traced.coverage.shape), HALF)
    except ValueError:
        return traced
    inside = traced.coverage >= HALF
    about = distance_transform_edt(~inside) - distance_transform_edt(inside)
    band = np.abs(about) <= BAND_PX
    points = pixel_grid(window).reshape(*inside.shape, 2)
    before, moved = np.asarray(about, dtype=np.float64), np.zeros(inside.shape)
    before[band] = signed_distance(outline, points[band])
    moved[band] = before[band] - signed_distance(reshape(outline), points[band])
    along = np.array(np.gradient(before))
    along /= np.maximum(np.linalg.norm(along, axis=0), 1e-12)
    where = np.indices(inside.shape) - moved * along
    radiance, coverage = (map_coordinates(picture, where, order=3, mode="nearest") for picture in (traced.radiance, traced.coverage))
    return Traced(np.maximum(radiance, 0.0), np.clip(coverage, 0.0, 1.0))


def signed_distance(outline_px: Float[NDArray[np.float64], "n 2"], points_px: Float[NDArray[np.float64], "m 2"]) -> Array:
    """Distance (px) of points to an outline, negative inside."""
    distance = shapely.distance(shapely.points(points_px), shapely.linearrings(outline_px))
    return np.asarray(np.where(shapely.contains_xy(shapely.Polygon(outline_px), *points_px.T), -distance, distance))
