"""Means over sectors of noisy samples are those of their noise: none, on the steps of a rough body, too."""

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from estimator.appearance.sector_shape import sectors_of
from estimator.measurements.outlines.contacts import SECTORS, _sectors

Array = NDArray[np.float64]
SIGMA_PX, DRAWS = 0.2, 400


def toothed() -> tuple[Array, Array]:
    """Samples (n, 2) px and normals of an outline with 24 teeth, their sides along the lines of sight from its middle."""
    turn = np.linspace(0.0, 2.0 * np.pi, 49)[:-1]
    radius = np.where(np.arange(48) % 2, 21.0, 19.0)
    corners = [r * np.array([np.cos(t), np.sin(t)]) for i, t in enumerate(turn) for r in (radius[i - 1], radius[i])]
    ring = shapely.Polygon(corners).exterior
    points, next_ = (
        shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(0.0, ring.length, 1.0) + s)) for s in (0.0, 0.01)
    )
    along = next_ - points
    return points, np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]


def receding(by_noisy_place: bool) -> float:
    """By how much (px) the noise of samples in sectors of teeth is less than that of samples in sectors between them."""
    points, normals = toothed()
    rng, off = np.random.default_rng(0), []
    raised = np.bincount(sectors_of(points, np.zeros(2), SECTORS), np.linalg.norm(points, axis=1), SECTORS)
    raised = raised / np.maximum(np.bincount(sectors_of(points, np.zeros(2), SECTORS), minlength=SECTORS), 1)
    for _ in range(DRAWS):
        noise = SIGMA_PX * rng.normal(size=len(points))
        seen = points + noise[:, None] * normals
        sector = sectors_of(seen, seen.mean(axis=0), SECTORS) if by_noisy_place else _sectors([seen])
        off.append(np.polyfit(raised[sector], noise, 1)[0])
    return -float(np.mean(off)) * 2.0


def test_noise_does_not_choose_its_sector() -> None:
    biased = receding(by_noisy_place=True)
    assert biased > 0.02
    assert receding(by_noisy_place=False) == pytest.approx(0.0, abs=0.25 * biased)
