"""Where predictions miss: residuals of held-out impacts over the impact's angle, spin, speed and the curvature of what touched.

Residuals are measured less predicted, in standard deviations, along three directions that contact physics knows: the plate's normal
(restitution), the direction in which the corner arrived along the plate (friction), and the spin that the predicted impulse makes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.stats import spearmanr

from estimator.contact_validation.contacts import nominal
from estimator.contact_validation.fitting import Impacts
from estimator.contact_validation.held_out import Judged
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
KINDS = ("normal", "sliding", "spin")
NEAR_SHARE = 0.12
"""Corners within this part of the extent of the one that touched tell the curvature there."""
TELLING_P = 0.01
"""p-value, corrected for the number of maps, below which a map is said to show something."""


@dataclass(frozen=True)
class ResidualMap:
    """Residuals of one ``kind`` over one ``axis``; ``place`` and ``residual`` (n,), ``rank_correlation`` and its ``p``."""

    axis: str
    unit: str
    kind: str
    place: Array
    residual: Array
    rank_correlation: float
    p: float

    @property
    def telling(self) -> bool:
        """Whether residuals follow the axis."""
        return self.p < TELLING_P


def residual_maps(impacts: Impacts, judged: Judged) -> tuple[ResidualMap, ...]:
    """Every kind over every axis, the strongest first."""
    residuals = directed(impacts, judged.residuals)
    found = []
    for axis, unit, place in axes_of(impacts.measured):
        for kind, residual in zip(KINDS, residuals.T, strict=True):
            rank, p = spearmanr(place, residual) if np.ptp(place) > 0.0 and np.ptp(residual) > 0.0 else (0.0, 1.0)
            found.append(ResidualMap(axis, unit, kind, place, residual, float(rank), float(p)))
    return tuple(sorted(found, key=lambda m: m.p))


def directed(impacts: Impacts, residuals: Array) -> Float[NDArray[np.float64], "impact 3"]:
    """``residuals`` (n, 6), in v and omega, along normal, sliding direction and spin made, in standard deviations."""
    contacts = nominal(impacts.measured)
    u = contacts.velocities
    along = np.einsum("ni,nij->nj", np.column_stack([u[:, :2], np.zeros(len(u))]), contacts.axes)
    jump = impacts.after - np.concatenate([contacts.v, contacts.omega], axis=1)
    nothing = np.zeros_like(along)
    directions = (
        np.concatenate([contacts.axes[:, 2], nothing], axis=1),
        np.concatenate([_unit(along), nothing], axis=1),
        np.concatenate([nothing, _unit(jump[:, 3:])], axis=1),
    )
    covariances = np.linalg.inv(np.einsum("nji,njk->nik", impacts.whitening, impacts.whitening))
    rows = [(d * residuals).sum(axis=1) / np.sqrt(np.einsum("ni,nij,nj->n", d, covariances, d)) for d in directions]
    return np.stack(rows, axis=1)


def axes_of(measured: Sequence[MeasuredImpact]) -> list[tuple[str, str, Array]]:
    """Name, unit and place (n,) of each impact on every axis."""
    u = nominal(measured).velocities
    angle = np.degrees(np.arctan2(np.linalg.norm(u[:, :2], axis=1), -u[:, 2]))
    return [
        ("impact angle", "°", angle),
        ("spin", "rad/s", np.array([float(np.linalg.norm(i.state.omega_world)) for i in measured])),
        ("speed", "m/s", np.linalg.norm(u, axis=1)),
        ("curvature", "1/mm", np.array([1e-3 * curvature(i) for i in measured])),
    ]


def curvature(impact: MeasuredImpact) -> float:
    """Curvature (1/m) of the hull at the corner that touches: 2 h / d² of the corners near it, h above the plate, d along it; median."""
    corners, n = impact.low_corners, impact.plate.normal_world
    lowest = corners[int(np.argmin(corners @ n))]
    away = corners - lowest
    height = away @ n
    along2 = (away**2).sum(axis=1) - height**2
    near = (along2 > 0.0) & (along2 < (NEAR_SHARE * impact.extent_m) ** 2)
    return float(np.median(2.0 * height[near] / along2[near])) if near.any() else 2.0 / impact.extent_m


def _unit(rows: Array) -> Array:
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-12))
