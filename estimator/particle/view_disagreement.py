"""How much more the calibrated views disagree with one another than the noise of their outlines explains.

A pair's error in the picture of view i has the variance ``s² + c² (1 + m²)``: ``s²`` of both outlines' noise, ``m`` how much view j's
errors are magnified there, ``c`` the standard deviation (px) by which the stated calibration misplaces the outline of a view. So ``c²`` is
the mean of ``(e² - s²) / (1 + m²)`` over all pairs, a variance component by the method of moments [Searle, Casella and McCulloch, Variance
Components, 1992, ch. 5]. Drawn errors of 0.5, 1 and 2 px are found as 0.46 to 0.60, 0.94 to 1.19 and 1.9 to 2.4 px by 6 to 60 views.

One number stands for all views; a single view that is far off is left out before (:func:`estimator.particle.particle.view_agreement`).
Errors that all views share, such as a wrong scale, do not show.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.epipolar_tangency import PoseSet, tangency_errors
from estimator.geometry.silhouettes import SURE_PX, Silhouettes

Array = NDArray[np.float64]
MOST_MEAN_SQUARE = 2.0
"""Mean square of the views' errors over their expected variance that is still noise: 0.5 to 1.0 for 6 to 60 views that are right."""
UNEXPLAINED_PX = 0.1
"""What smoothing leaves of corners even where outlines are free of noise; it is no disagreement."""
DISPLACED_RAD = 1.0
"""Turn of the tangent over which a misplaced outline's error is alike: that of a shift is the cosine of the turn."""


@dataclass(frozen=True)
class Disagreement:
    """Of k views: ``mean_square`` of their errors over what outlines explain, ``rms_px`` and the RMS ``expected_px`` from outlines.

    ``view_rms_px`` (k,) of each against the others; ``calibration_px`` is the standard deviation by which a view is misplaced, zero where
    outlines explain the errors; ``seen_share``: of the pairs of views that have common tangents.
    """

    mean_square: float
    rms_px: float
    expected_px: float
    view_rms_px: Array
    calibration_px: float
    seen_share: float

    @property
    def beyond_noise(self) -> bool:
        """Whether outlines do not explain the errors."""
        return self.calibration_px > 0.0


def disagreement(seen: Silhouettes, poses: PoseSet, centre: Array) -> Disagreement:
    """That of k views at stated ``poses``; ``centre`` (3,) m of the body, particle frame."""
    k = len(seen)
    errors = tangency_errors(seen, poses, seen, poses, pivot_particle=centre, weight=1.0 - np.eye(k))
    there = errors.told[:, :, :2]
    square, expected = (np.where(there, values, 0.0) for values in (errors.error[:, :, :2] ** 2, errors.variance[:, :, :2]))
    count = max(int(there.sum()), 1)
    own = square.sum(axis=(1, 2)) / np.maximum(there.sum(axis=(1, 2)), 1)
    ratio = float((square[there] / (expected[there] + UNEXPLAINED_PX**2)).sum()) / count
    excess = float(((square - expected) / (1.0 + errors.jacobian[:, :, :2, 7] ** 2))[there].sum()) / count
    misplaced = float(np.sqrt(max(excess, 0.0))) if ratio > MOST_MEAN_SQUARE else 0.0
    rms, explained = (float(np.sqrt(values.sum() / count)) for values in (square, expected))
    return Disagreement(ratio, rms, explained, np.sqrt(own), misplaced, float(errors.valid.sum()) / max(k * (k - 1), 1))


def misplaced(seen: Silhouettes, calibration_px: float) -> Silhouettes:
    """Outlines of views whose stated poses misplace them by ``calibration_px`` besides their noise."""
    if calibration_px == 0.0:
        return seen
    own = np.array([_typical(seen.sigma_px[seen.slice_of(i)]) for i in range(len(seen))]) ** 2
    share = calibration_px**2 / (own + calibration_px**2)
    correlation = (1.0 - share) * seen.correlation_rad + share * DISPLACED_RAD
    return replace(seen, sigma_px=np.hypot(seen.sigma_px, calibration_px), correlation_rad=correlation)


def _typical(sigma_px: Array) -> float:
    sure = sigma_px[sigma_px < SURE_PX]
    return float(np.median(sure)) if len(sure) else 0.0
