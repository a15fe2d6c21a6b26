"""Bending an ideal picture into that of a camera with Brown-Conrady distortion or unequal focal lengths.

The ideal picture is rendered ``OVERSAMPLING`` times finer over the region that the window shows. Every real pixel then averages
``OVERSAMPLING`` × ``OVERSAMPLING`` points of its area, each interpolated bilinearly in the ideal picture, which spreads an edge by less
than half a real pixel and, being symmetric, does not move it.
"""

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from synth.rendering.camera import IdealFilm, ThinLens
from synth.rendering.tracer import Traced
from synth.rendering.window import Window

Array = NDArray[np.float64]

OVERSAMPLING = 2


def ideal_film(intrinsics: Intrinsics, lens: ThinLens) -> IdealFilm:
    """The finer film of the camera without distortion, its principal point at pixel (0, 0)."""
    return IdealFilm(OVERSAMPLING * max(intrinsics.fx_px, intrinsics.fy_px), 0.0, 0.0, lens)


def sample_points(window: Window, intrinsics: Intrinsics, film: IdealFilm) -> Float[NDArray[np.float64], "height width 2"]:
    """Where on the ideal film (px) the sample points of a window of the real picture lie, ``OVERSAMPLING`` per pixel and axis."""
    steps = (np.arange(OVERSAMPLING) + 0.5) / OVERSAMPLING - 0.5
    u = (window.x0 + np.arange(window.width)[:, None] + steps).ravel()
    v = (window.y0 + np.arange(window.height)[:, None] + steps).ravel()
    real = np.stack(np.meshgrid(u, v), axis=-1)
    ideal = intrinsics.normalise(real.reshape(-1, 2)) * film.focal_px + [film.cx_px, film.cy_px]
    return ideal.reshape(real.shape)


def needed_window(points: Float[NDArray[np.float64], "height width 2"]) -> Window:
    """The window of the ideal film that interpolation at ``points`` (px) needs."""
    low = np.floor(points.min(axis=(0, 1))).astype(int) - 1
    high = np.ceil(points.max(axis=(0, 1))).astype(int) + 2
    return Window(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def bend(ideal: Traced, ideal_window: Window, points: Float[NDArray[np.float64], "height width 2"]) -> Traced:
    """The real window from the ideal one, sampled at ``points`` of the ideal film."""
    local = (points - [ideal_window.x0, ideal_window.y0]).astype(np.float32)
    return Traced(_averaged(ideal.radiance, local), _averaged(ideal.coverage, local))


def _averaged(picture: Array, points: NDArray[np.float32]) -> Array:
    fine = cv2.remap(picture.astype(np.float32), points[..., 0], points[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    height, width = fine.shape[0] // OVERSAMPLING, fine.shape[1] // OVERSAMPLING
    blocks = fine.astype(np.float64).reshape(height, OVERSAMPLING, width, OVERSAMPLING)
    return np.asarray(blocks.mean(axis=(1, 3)))
