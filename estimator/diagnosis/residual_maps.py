"""Where a model fails: maps of the signed, outline-normal residual over time, place, direction, speed, spin and calibrated view.

A residual is positive where the outline lies outside of what the model predicts. In every bin of a map the residuals ``e`` with outward
normals ``u`` are taken apart by least squares: ``e = offset + u . d``, so a map shows outlines that are too large or too small (offset)
and outlines that are displaced, along the particle's velocity in the picture or along the picture's axes (d). Over directions and views
only the offset makes sense.

Standard errors are clustered by frame [Cameron, Gelbach and Miller 2011]: all residuals of one silhouette share its noise. Over
calibrated views each view's own noise and the body-fixed error, which repeat in all frames, are added. Whether a map shows anything is
Hotelling's T-squared of all its bins, its p-value corrected for the number of maps.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

from estimator.diagnosis.map_axes import Axes, Axis, axes_of
from estimator.fitting.campaign import Campaign, CampaignFit, SequenceEquations
from estimator.fitting.composite_likelihood import body_cells
from estimator.fitting.noise_model import tangent_correlation

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEAST_IN_BIN = 20
SIGNIFICANT = 0.01
COMPONENTS = {
    "offset": "outwards",
    "along_v": "along the velocity",
    "along_x": "along the picture's x",
    "along_y": "along the picture's y",
}


@dataclass(frozen=True)
class ResidualMap:
    """One map: the component ``kind`` of the residual over one axis.

    ``centre`` (b,) middle of each bin in the axis's unit, ``second`` (b,) that of its second coordinate where it has one; ``mean_px`` and
    ``sigma_px`` (b,), ``count`` (b,) residuals; ``statistic`` Hotelling's F, ``p`` corrected for the number of maps.
    """

    axis: Axis
    kind: str
    bins: Index
    mean_px: Array
    sigma_px: Array
    count: Index
    statistic: float
    p: float

    @property
    def centre(self) -> Array:
        """First coordinate of each bin."""
        return self.axis.centre[self.bins]

    @property
    def second(self) -> Array | None:
        """Second coordinate of each bin, if there is one."""
        return None if self.axis.second is None else self.axis.second[self.bins]

    @property
    def significant(self) -> bool:
        """Whether it shows something that noise does not."""
        return self.p < SIGNIFICANT


def residual_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit, those that show most first."""
    axes = axes_of(campaign, fit)
    e = np.concatenate([each.errors.e[_seen(each)] for each in fit.equations])
    frame = _frames(fit)
    directions = _directions(fit, axes)
    views = _view_variance(campaign, fit)
    maps = []
    for axis in axes.axes:
        for kind in COMPONENTS if axis.displaces else ("offset",):
            found = _map(axis, kind, e, (frame, directions), views if axis.name == "view" else np.zeros(len(axis.centre)))
            if found is not None:
                maps.append(found)
    corrected = [_with_p(each, min(1.0, each.p * len(maps))) for each in maps]
    return tuple(sorted(corrected, key=lambda m: (m.p, -m.statistic)))


def _with_p(found: ResidualMap, p: float) -> ResidualMap:
    return ResidualMap(found.axis, found.kind, found.bins, found.mean_px, found.sigma_px, found.count, found.statistic, p)


def _seen(each: SequenceEquations) -> NDArray[np.bool_]:
    return np.repeat(each.errors.tangency.valid[:, :, None], 2, axis=2)


def _frames(fit: CampaignFit) -> Index:
    """Number of the silhouette that each residual belongs to, over all sequences."""
    numbers, first = [], 0
    for each in fit.equations:
        seen = _seen(each)
        numbers.append(first + np.nonzero(seen)[0])
        first += len(seen)
    return np.concatenate(numbers).astype(np.int64)


def _directions(fit: CampaignFit, axes: Axes) -> dict[str, Array]:
    """``u`` taken along each component's direction, per residual."""
    u = np.concatenate([each.errors.places.normal[_seen(each)] for each in fit.equations])
    v = axes.velocity_direction
    return {"x": u[:, 0], "y": u[:, 1], "along": np.sum(u * v, axis=1), "across": u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]}


def _design(kind: str, directions: dict[str, Array], n: int, displaces: bool) -> tuple[Array, int]:
    """Columns (n, c) that a bin's residuals are taken apart into, and which of them is the map's."""
    if not displaces:
        return np.ones((n, 1)), 0
    if kind == "along_v":
        return np.column_stack([np.ones(n), directions["along"], directions["across"]]), 1
    return np.column_stack([np.ones(n), directions["x"], directions["y"]]), ("offset", "along_x", "along_y").index(kind)


def _view_variance(campaign: Campaign, fit: CampaignFit) -> Array:
    """Variance (k,) px² of each calibrated view's mean residual that its own outline's noise and the body-fixed error bring."""
    count = max(len(s.task.views.silhouettes) for s in campaign.sequences)
    total, number = np.zeros(count), np.zeros(count)
    for sequence, each in zip(campaign.sequences, fit.equations, strict=True):
        tangency, second = each.errors.tangency, sequence.task.views.silhouettes
        cells = body_cells(each.errors.normals, each.errors.viewing)
        for k in range(len(second)):
            row, side = np.argwhere(np.repeat(tangency.valid[:, k][:, None], 2, axis=1)).T
            sigma = second.sigma_px[second.offsets[k] + tangency.tangency[row, k, 2 + side]] * tangency.jacobian[row, k, side, 7]
            K = tangent_correlation(tangency.direction[row, k, 2 + side], float(second.correlation_rad[k]))
            shared = np.bincount(cells[row, k, side]).astype(np.float64)
            total[k] += sigma @ K @ sigma + campaign.body_noise_px**2 * float(shared @ shared)
            number[k] += len(row)
    return np.asarray(len(campaign.sequences) * total / np.maximum(number, 1.0) ** 2)


def _map(axis: Axis, kind: str, e: Array, at: tuple[Index, dict[str, Array]], extra: Array) -> ResidualMap | None:
    """One map; ``extra`` (b,) px² variance of each bin's mean beside that of the frames."""
    frame, directions = at
    X, wanted = _design(kind, directions, len(e), axis.displaces)
    clusters = int(frame.max()) + 1
    kept, means, influence, counts = [], [], [], []
    for number in range(len(axis.centre)):
        rows = np.flatnonzero(axis.bin == number)
        if len(rows) < LEAST_IN_BIN or len(np.unique(frame[rows])) < 4:
            continue
        A = np.linalg.pinv(X[rows].T @ X[rows])
        beta = A @ (X[rows].T @ e[rows])
        part = (X[rows] * (e[rows] - X[rows] @ beta)[:, None]) @ A[:, wanted]
        kept.append(number)
        means.append(beta[wanted])
        influence.append(np.bincount(frame[rows], part, clusters))
        counts.append(len(rows))
    if len(kept) < 2:
        return None
    mean, parts = np.array(means), np.array(influence)
    covariance = parts @ parts.T + np.diag(extra[kept])
    statistic, p = _hotelling(mean, np.asarray(covariance, dtype=np.float64), clusters)
    sigma = np.sqrt(np.diag(covariance))
    return ResidualMap(axis, kind, np.array(kept), mean, sigma, np.array(counts, dtype=np.int64), statistic, p)


def _hotelling(mean: Array, covariance: Array, clusters: int) -> tuple[float, float]:
    """F statistic and p-value of means (b,) being zero."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, vector = np.linalg.eigh(covariance * scale[:, None] * scale)
    kept = value > 0.05
    z = (vector[:, kept].T @ (mean * scale)) / np.sqrt(value[kept])
    b = int(kept.sum())
    free = max(clusters - b, 1)
    statistic = float(z @ z) * free / (b * max(clusters - 1, 1))
    return statistic, float(f_distribution.sf(statistic, b, free))


def shown(maps: Sequence[ResidualMap]) -> tuple[ResidualMap, ...]:
    """The best map of every axis, those that show most first."""
    best: dict[str, ResidualMap] = {}
    for each in maps:
        best.setdefault(each.axis.name, each)
    return tuple(best.values())
