"""The light in one picture without its objects: a smooth polynomial fitted to whatever is not an object.

A bivariate cubic follows the fall-off of a panel and vignetting; objects are rejected by
iteration (first what is far from the median, then what is far from the fit). Valid while the objects cover less than
about a third of the picture and the illumination has no structure finer than a quarter of it.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy.polynomial.legendre import legvander2d
from numpy.typing import NDArray

Picture = Float[NDArray[np.float32], "height width"]
Mask = Bool[NDArray[np.bool_], "height width"]

_TERMS = np.array([4 * i + j for i in range(4) for j in range(4 - i)])
_COARSE = 96
"""Pixels along the shorter side of the grid that a polynomial of the light is fitted to: it varies slowly."""


@dataclass(frozen=True)
class Illumination:
    """Smooth light level (DN) of a picture, its objects' mask and whether they are darker than the light (``bright``)."""

    level: Picture
    objects: Mask
    bright: bool


def illumination_of(picture: Picture, *, rejections: int = 6) -> Illumination:
    """Fit the smooth light level of ``picture`` (DN) and mark what departs from it (grown by 3 px)."""
    shape = picture.shape
    step = max(1, min(shape) // _COARSE)
    coarse = cv2.resize(picture, (shape[1] // step, shape[0] // step), interpolation=cv2.INTER_AREA)
    centre = float(np.median(coarse))
    tolerance = max(0.3 * abs(centre), 3 * 1.4826 * float(np.median(np.abs(coarse - centre))), 1.0)
    inside = np.abs(coarse - centre) < tolerance
    level = np.full_like(coarse, centre)
    for _ in range(rejections):
        level = fitted_surface(coarse, inside)
        departure = coarse - level
        spread = 1.4826 * float(np.median(np.abs(departure[inside]))) + 0.004 * centre + 0.25
        inside = np.abs(departure) < 4.0 * spread
    outside = (coarse - level)[~inside]
    full = np.asarray(cv2.resize(level, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC), dtype=np.float32)
    mask = cv2.resize((~_without_specks(inside)).astype(np.uint8), (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST)
    grown = cv2.dilate(mask, np.ones((2 * step + 5, 2 * step + 5), np.uint8)) > 0
    return Illumination(full, np.asarray(grown, dtype=bool), bool(outside.sum() <= 0))


def fitted_surface(picture: Picture, valid: Mask) -> Picture:
    """The cubic surface fitted by least squares to the ``valid`` pixels, over the whole picture."""
    height, width = picture.shape
    terms = legvander2d(*np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height)), [3, 3])[..., _TERMS]
    used = terms[valid]
    if len(used) < 4 * used.shape[1]:
        return np.full_like(picture, np.median(picture))
    weights = np.linalg.solve(used.T @ used, used.T @ picture[valid].astype(np.float64))
    return np.asarray(terms @ weights, dtype=np.float32)


def _without_specks(inside: Mask) -> Mask:
    """``inside`` with deviations that hold no 2 x 2 pixels (noise) forgiven; larger ones keep their thin tips [opening by reconstruction].

    Not OpenCV's opening: by an even kernel it moves what it keeps by a pixel, 10 px of the whole picture, off the object's own tips.
    """
    deviating = (~inside).astype(np.uint8)
    labels = cv2.connectedComponents(deviating, connectivity=8)[1]
    solid = cv2.erode(deviating, np.ones((2, 2), np.uint8)) > 0
    return np.asarray(~np.isin(labels, labels[solid]), dtype=bool)
