"""The blur of a picture: a Gaussian of the lens, longer along the motion during the exposure.

Described by its covariance ``C`` (2, 2; px²; x, y). A smear of length L is uniform, not Gaussian, but has the same first two
moments with ``L²/12`` along its direction, and an outline's place hangs on little else while L is below a few pixels.
"""

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Picture = Float[NDArray[np.float32], "height width"]
Covariance = Float[NDArray[np.float64], "2 2"]

LEAST_VARIANCE = 0.005
"""Of a blur (px²): 0.07 px, below what pixels show."""
_WIDEST_VARIANCE = 400.0
"""Of a blur (px²): 20 px, more than any outline survives."""
_LONGEST_SMEAR = 8.0
"""Variance (px²) that a motion adds along itself: one of 10 px. By judgement."""
_SMALL = 0.4
"""Variance (px²) up to which three taps make a blur; above, samples of the Gaussian do within 1%."""


def isotropic(blur_px: float) -> Covariance:
    """The covariance of the same blur in all directions."""
    return blur_px**2 * np.eye(2)


def bounded(covariance: Covariance) -> Covariance:
    """The nearest covariance that a picture can have: variances (px²) within limits, a smear (variance along less across) too."""
    values, axes = np.linalg.eigh(covariance)
    across = float(np.clip(values[0], LEAST_VARIANCE, _WIDEST_VARIANCE))
    along = float(np.clip(values[1], across, across + _LONGEST_SMEAR))
    return np.asarray(axes @ np.diag([across, along]) @ axes.T)


def narrowest(covariance: Covariance) -> float:
    """Standard deviation (px) across the smear: what is left of it is the lens."""
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[0]))


def fitted_blur(variances: Float[NDArray[np.float64], " n"], normals: Float[NDArray[np.float64], "n 2"]) -> Covariance:
    """The covariance whose variances along the ``normals`` fit best: ``n' C n``, with outliers drawn in to the middle half's spread."""
    middle = float(np.median(variances))
    spread = 3.0 * float(np.median(np.abs(variances - middle))) + 1e-6
    nx, ny = normals.T
    xx, xy, yy = np.linalg.lstsq(
        np.column_stack([nx**2, 2 * nx * ny, ny**2]), np.clip(variances, middle - spread, middle + spread), rcond=None
    )[0]
    return np.array([[xx, xy], [xy, yy]])


def blurred(picture: Picture, covariance: Covariance) -> Picture:
    """``picture`` after a Gaussian of ``covariance``: evenly by the smaller variance, then along the smear in small steps."""
    values, axes = np.linalg.eigh(covariance)
    kernel = gaussian_kernel(float(np.sqrt(values[0])))
    result = cv2.sepFilter2D(picture, -1, kernel, kernel, borderType=cv2.BORDER_REPLICATE)
    smear = values[1] - values[0]
    steps = int(np.ceil(smear / _SMALL))
    for _ in range(steps):
        result = cv2.filter2D(result, -1, _small_kernel(smear / steps * np.outer(axes[:, 1], axes[:, 1])), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(result, dtype=np.float32)


def gaussian_kernel(blur_px: float) -> Float[NDArray[np.float64], " tap"]:
    """Discrete Gaussian of variance ``blur_px**2`` (within 1%): sampled; three taps where sampling would misstate the variance."""
    variance = blur_px**2
    if variance < _SMALL:
        return np.array([variance / 2, 1.0 - variance, variance / 2])
    reach = int(np.ceil(4 * blur_px)) + 1
    taps = np.arange(-reach, reach + 1)
    weights: NDArray[np.float64] = np.exp(-(taps**2) / (2 * variance))
    return weights / weights.sum()


def _small_kernel(covariance: Covariance) -> Float[NDArray[np.float64], "3 3"]:
    """Nine taps with exactly this (small) covariance; rows are y, columns x."""
    xx, xy, yy = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    diagonal = abs(xy)
    kernel = np.zeros((3, 3))
    kernel[1, 0] = kernel[1, 2] = (xx - diagonal) / 2
    kernel[0, 1] = kernel[2, 1] = (yy - diagonal) / 2
    falling = (0, 0), (2, 2)
    rising = (0, 2), (2, 0)
    for corner in falling if xy > 0 else rising:
        kernel[corner] = diagonal / 2
    kernel[1, 1] = 1.0 - kernel.sum()
    return kernel
