"""How pictures show an outline that is known: it is drawn as the camera would have pictured it, and measured again.

What deblurring leaves of rounded corners, what the grid of pixels does to edges sharper than a pixel and what smoothing cuts is not
described but repeated: the outline's coverage is blurred as its picture was, gets the noise of its pixels, and goes through
:mod:`estimator.outlines.pictures.contour` and :mod:`estimator.geometry.tangent_hull`. The smear of a motion is left out: 1.6 px of it move
tangents by 0.005 px. Made for indirect inference [Gourieroux, Monfort and Renault 1993]: outlines are compared that went through the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from datasets.vocabulary.outline import oriented
from estimator.geometry.coverage import coverage
from estimator.geometry.support import support
from estimator.geometry.tangent_hull import TangentHull, tangent_hull
from estimator.outlines.pictures.blur import LEAST_VARIANCE, blurred, isotropic
from estimator.outlines.pictures.contour import PIXEL_VARIANCE, edge_blur, half_level_contour, refined
from estimator.outlines.pictures.frame import WIDTH_10_90
from estimator.outlines.result import FrameOutline
from estimator.outlines.settings import OutlineSettings

Array = NDArray[np.float64]
MARGIN_BLURS, LEAST_MARGIN_PX = 5.0, 10.0
"""Margin of a drawing around an outline: blurs, and pixels beside."""
SUCCESSION = 5
"""Pictures of which the median width of edges is taken (notebook 40)."""


@dataclass(frozen=True)
class Pictures:
    """Of n pictures the ``blur_px`` (n,) of edges, a Gaussian's standard deviation, and the ``noise`` (n,) of a pixel over the contrast."""

    blur_px: Array
    noise: Array

    @classmethod
    def of(cls, frames: Sequence[FrameOutline]) -> "Pictures":
        """Those of frames with an outline."""
        widths = np.array([frame.edge_width_px for frame in frames]) / WIDTH_10_90
        return cls(np.sqrt(np.maximum(widths**2 - PIXEL_VARIANCE, LEAST_VARIANCE)), np.array([frame.noise for frame in frames]))

    def edge_px(self, camera: Int[NDArray[np.int64], " n"]) -> Float[NDArray[np.float64], " n"]:
        """Standard deviation (px) of the blur of edges, the pixel's own with it; medians of pictures that ``camera`` took in succession."""
        blur = self.blur_px.copy()
        for number in np.unique(camera):
            blur[camera == number] = median_filter(blur[camera == number], SUCCESSION, mode="nearest")
        return np.asarray(np.sqrt(blur**2 + PIXEL_VARIANCE))

    def typical(self, count: int) -> "Pictures":
        """``count`` pictures, each with the medians of these."""
        return Pictures(np.full(count, np.median(self.blur_px)), np.full(count, np.median(self.noise)))


def pictured_supports(
    polygons: Sequence[Array], pictures: Pictures, outward: Float[NDArray[np.float64], "d 2"], *, draws: int, rng: np.random.Generator
) -> Float[NDArray[np.float64], "n d"]:
    """Mean supports (px) along ``outward`` of ``polygons`` (v, 2) px as ``pictures``, one each, show them.

    ``draws`` of noise and of where the grid of pixels lies for each. Outlines of which nothing is seen are as they are.
    """
    found = np.zeros((len(polygons), len(outward)))
    for i, polygon in enumerate(polygons):
        if len(polygon):
            hulls = [_seen(polygon, float(pictures.blur_px[i]), float(pictures.noise[i]), rng) for _ in range(draws)]
            found[i] = np.mean([support(hull, outward) for hull in hulls], axis=0)
    return found


def mean_seen(polygon: Array, outward: Array, pictures: Pictures, *, draws: int, rng: np.random.Generator) -> Array:
    """Support points (d, 2) px of the Minkowski mean of the hulls that pictures like the first of ``pictures`` show.

    ``polygon`` (v, 2) px, ``outward`` (d, 2).
    """
    hulls = [_seen(polygon, float(pictures.blur_px[0]), float(pictures.noise[0]), rng) for _ in range(draws)]
    return np.mean([hull[np.argmax(hull @ outward.T, axis=0)] for hull in hulls], axis=0)


def _seen(polygon: Array, blur_px: float, noise: float, rng: np.random.Generator) -> Array:
    """Vertices (w, 2) px of the hull of an outline's tangents, measured in one picture of it; the outline itself where none is found."""
    settings = OutlineSettings()
    margin = LEAST_MARGIN_PX + MARGIN_BLURS * blur_px
    corner = polygon.min(axis=0) - margin - rng.uniform(0.0, 1.0, 2)
    width, height = (int(n) for n in np.ceil(polygon.max(axis=0) - corner + margin))
    sharp = coverage(oriented(polygon - corner), (height, width))
    picture = blurred(sharp, isotropic(blur_px)) + np.float32(noise) * rng.standard_normal((height, width), dtype=np.float32)
    contour = half_level_contour(picture)
    if contour is None:
        return polygon
    edge = refined(contour, picture, blur_px=edge_blur(contour, picture), spacing_px=settings.spacing_px, rounds=settings.refinements)
    hull: TangentHull = tangent_hull(edge.points_px)
    return hull.points_px + corner if len(hull.points_px) else polygon
