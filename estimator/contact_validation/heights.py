"""Heights at impacts against a mesh: whether a body of the mesh's size touches one plane wherever it strikes.

At an impact the centre of mass is as high above the plate as the lowest corner of the body lies below it. With recorded lengths ``1 + s``
times too short, and the plane at ``offset`` along the plate's normal ``n``, the recorded height is

    n·x = offset + d / (1 + s),      d = -min n·(R c) over the corners c of the mesh,

a straight line in ``d``. Some events that are taken for impacts are none: residuals have Student's density, whose scale is that of their
median and no less than the stated noise [Lange, Little and Taylor 1989]. Valid where all impacts are on one plane that stands still in the
world frame, and where the mesh is the body's, in metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.contact_validation.measured import TURN, MeasuredImpact, X
from estimator.effects.link import TAILS
from estimator.geometry.robust_scale import robust_sigma

Array = NDArray[np.float64]
LEAST = 4
"""Impacts from which on a line with its scatter can be fitted."""
ROUNDS = 30
"""Re-weightings; the last ones change nothing."""
SAME_PLANE = 1e-6
"""Largest difference between the normals of impacts on one plane."""


@dataclass(frozen=True)
class Heights:
    """The line.

    ``scale`` and ``scale_sigma``: true lengths over recorded ones, minus 1; ``offset_m`` and ``offset_sigma_m``: the recorded place of the
    plane along its normal; ``excess``: scatter of the ``count`` impacts about the line over the stated noise, 1 at least.
    """

    scale: float
    scale_sigma: float
    offset_m: float
    offset_sigma_m: float
    excess: float
    count: int


def heights_against(impacts: Sequence[MeasuredImpact]) -> Heights | None:
    """Recorded heights at impacts against those of the mesh; ``None`` where there are too few, on several planes, or all at one height."""
    normals = np.array([impact.plate.normal_world for impact in impacts])
    if len(impacts) < LEAST or np.abs(normals - normals[0]).max() > SAME_PLANE:
        return None
    height = np.array([impact.state.x_world @ impact.plate.normal_world for impact in impacts])
    lowest = np.array([_lowest(impact) for impact in impacts])
    depth = np.array([-low @ n for low, n in zip(lowest, normals, strict=True)])
    weight = np.array([_variance(impact, low) for impact, low in zip(impacts, lowest, strict=True)]) ** -0.5
    A = np.column_stack([np.ones(len(depth)), depth]) * weight[:, None]
    if np.linalg.matrix_rank(A) < A.shape[1]:
        return None
    (offset, slope), covariance, excess = _line(A, height * weight, np.array([np.median(height - depth), 1.0]))
    sigma = np.sqrt(np.diag(covariance))
    return Heights(float(1.0 / slope - 1.0), float(sigma[1] / slope**2), float(offset), float(sigma[0]), excess, len(impacts))


def _line(A: Array, y: Array, start: Array) -> tuple[Array, Array, float]:
    """Parameters, their covariance, and the scale of residuals under Student's density, from whitened rows A (n, 2) and y (n,)."""
    p = start
    for _ in range(ROUNDS):
        residual = y - A @ p
        scale = max(float(robust_sigma(residual)), 1.0)
        weight = (TAILS + 1.0) / (TAILS + (residual / scale) ** 2)
        H = A.T @ (weight[:, None] * A)
        p = np.asarray(np.linalg.solve(H, A.T @ (weight * y)))
    covariance = scale**2 * np.linalg.inv(H) * (TAILS + 3.0) / (TAILS + 1.0)
    return np.asarray(p), np.asarray(covariance), scale


def _lowest(impact: MeasuredImpact) -> Array:
    """The lowest corner (3,) m from the centre of mass, world axes."""
    corners = impact.low_corners
    return np.asarray(corners[np.argmin(corners @ impact.plate.normal_world)])


def _variance(impact: MeasuredImpact, arm: Array) -> float:
    """Variance (m²) of a height less the mesh's: of the place, of the turn, and of the corner."""
    n = impact.plate.normal_world
    by = np.zeros(len(impact.covariance))
    by[X], by[TURN] = n, np.cross(arm, n)
    return float(by @ impact.covariance @ by + impact.corner_sigma_m**2)
