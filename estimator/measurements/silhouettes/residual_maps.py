"""Where a model of silhouettes fails: maps of the signed, outline-normal residual over time, place, direction, speed, spin and view.

A residual is positive where the outline lies outside of what the model predicts. In every bin of a map the residuals ``e`` with outward
normals ``u`` are taken apart by least squares: ``e = offset + u . d``, so a map shows outlines that are too large or too small (offset)
and outlines that are displaced, along the particle's velocity in the picture or along the picture's axes (d). Over directions and views
only the offset makes sense.

Standard errors are clustered by frame, by place on each calibrated view's outline and by place on the body [Cameron, Gelbach and Miller
2011]: all residuals of one silhouette share its noise, a view's noise and the body-fixed error come back in all frames. Whether a map
shows anything is Hotelling's T-squared of all its bins, its p-value corrected for the number of maps.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from estimator.diagnosis.residual_maps import Axis, ResidualMap
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.campaign_noise import body_noise_px, places_of
from estimator.likelihood.body_fixed_error import field_covariance
from estimator.measurements.silhouettes.map_axes import Axes, axes_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEAST_IN_BIN, LEAST_FRAMES = 20, 4
"""Residuals, and frames, below which a bin is left out: standard errors clustered by frame need some. By judgement."""
VIEW_PLACES = 12
"""Places on a view's outline: about twice the turn over which its noise is alike."""
MOST_VIEWS = 10_000
"""Above any number of views: it makes numbers of clusters unique."""
BODY_SHARE = 0.5
"""Of the body-fixed error that covariances are kept safe with: what maps of recordings in which nothing is missing need."""
FIXED = ("view", "body_direction")
"""Axes along which places on the body stay together: the whole of that error counts."""
COMPONENTS = ("offset", "along_v", "along_x", "along_y")


class Clusters(Protocol):
    """What residuals (r,) share: numbers (r,) of their ``frame``, and what comes back in several frames."""

    @property
    def frame(self) -> Index:
        """The outline that each residual belongs to, over all sequences."""

    def covariance(self, influence: Array, residual: Array, axis: Axis) -> Array:
        """Covariance (b, b) of means over bins of an axis; ``influence`` (b, r) on them of what is left of each ``residual`` (r,) px."""


@dataclass(frozen=True)
class Mapped:
    """Residuals ``e`` (r,) px outwards and their outward normals ``u`` (r, 2), what they are mapped over, and what they share."""

    e: Array
    u: Array
    axes: Axes
    shared: Clusters

    @cached_property
    def directions(self) -> dict[str, Array]:
        """``u`` taken along each component's direction (r,)."""
        u, v = self.u, self.axes.velocity_direction
        return {"x": u[:, 0], "y": u[:, 1], "along": np.sum(u * v, axis=1), "across": u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]}

    @property
    def maps(self) -> tuple[ResidualMap, ...]:
        """All maps, those that show most first."""
        wanted = [(axis, kind) for axis in self.axes.axes for kind in (COMPONENTS if axis.displaces else ("offset",))]
        found = [each for axis, kind in wanted if (each := _map(axis, kind, self)) is not None]
        corrected = [replace(each, p=min(1.0, each.p * len(found))) for each in found]
        return tuple(sorted(corrected, key=lambda m: (m.p, -m.statistic)))


def silhouette_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit to silhouettes, those that show most first."""
    errors = [each.errors for each in fit.equations]
    e = np.concatenate([each.e[each.seen] for each in errors])
    u = np.concatenate([each.places.normal[each.seen] for each in errors])
    return Mapped(e, u, axes_of(campaign, fit), _repeated(campaign, fit)).maps


def frames_of(fit: CampaignFit) -> Index:
    """Number (r,) of the outline that each residual belongs to, over all sequences."""
    numbers, first = [], 0
    for each in fit.equations:
        seen = each.errors.seen
        numbers.append(first + np.nonzero(seen)[0])
        first += len(seen)
    return np.concatenate(numbers).astype(np.int64)


def _design(kind: str, directions: dict[str, Array], n: int, displaces: bool) -> tuple[Array, int]:
    """Columns (n, c) that a bin's residuals are taken apart into, and which of them is the map's."""
    if not displaces:
        return np.ones((n, 1)), 0
    if kind == "along_v":
        return np.column_stack([np.ones(n), directions["along"], directions["across"]]), 1
    return np.column_stack([np.ones(n), directions["x"], directions["y"]]), ("offset", "along_x", "along_y").index(kind)


@dataclass(frozen=True)
class _Repeated:
    """What comes back in residuals (r,): their ``frame``, their place on a view's outline and on the body, and how large those errors are.

    ``view_px`` (r,) standard deviation of the view's noise in the high-speed picture, ``body_px`` (r,) of the body-fixed error of their
    ``particle``.
    """

    frame: Index
    view_place: Index
    view_px: Array
    particle: Index
    body_place: Index
    body_px: Array

    def covariance(self, influence: Array, residual: Array, axis: Axis) -> Array:
        """Covariance (b, b) of means over bins of an axis; ``influence`` (b, r) on them of what is left of each ``residual`` (r,) px."""
        body_share = 1.0 if axis.name in FIXED else BODY_SHARE
        own = summed(influence * residual, self.frame)
        views = summed(influence * self.view_px, self.view_place)
        total = own @ own.T + views @ views.T
        for number in np.unique(self.particle):
            rows = self.particle == number
            total += field_covariance(self.body_place[rows], (influence * body_share * self.body_px)[:, rows].T)
        return np.asarray(total)


def summed(rows: Array, group: Index) -> Array:
    """Sums (b, groups) of rows (b, r) over groups; ``group`` (r,) their numbers."""
    count = int(group.max()) + 1
    return np.stack([np.bincount(group, row, count) for row in rows])


def _repeated(campaign: Campaign, fit: CampaignFit) -> _Repeated:
    errors = [each.errors for each in fit.equations]
    counts = [int(each.seen.sum()) for each in errors]
    seen = np.concatenate([each.seen for each in errors])
    places, sizes = [], []
    for sequence, each, group in zip(campaign.sequences, errors, campaign.particle, strict=True):
        tangency, second = each.tangency, sequence.task.views.silhouettes
        here = each.seen
        view = np.broadcast_to(np.arange(len(second))[None, :, None], here.shape)
        vertex = np.minimum(second.offsets[view] + np.maximum(tangency.tangency[:, :, 2:], 0), len(second.sigma_px) - 1)
        u = tangency.direction[:, :, 2:]
        turn = np.round(np.arctan2(u[..., 1], u[..., 0]) / (2.0 * np.pi) * VIEW_PLACES).astype(np.int64) % VIEW_PLACES
        places.append(((group * MOST_VIEWS + view) * VIEW_PLACES + turn)[here])
        sizes.append((second.sigma_px[vertex] * np.abs(tangency.jacobian[:, :, :2, 7]))[here])
    _, view_place = np.unique(np.concatenate(places), return_inverse=True)
    return _Repeated(
        frame=frames_of(fit),
        view_place=np.asarray(view_place, dtype=np.int64),
        view_px=np.concatenate(sizes),
        particle=np.repeat(np.array(campaign.particle, dtype=np.int64), counts),
        body_place=places_of(errors).cell[seen],
        body_px=np.repeat(body_noise_px(campaign, errors), counts),
    )


def _map(axis: Axis, kind: str, of: Mapped) -> ResidualMap | None:
    e, shared = of.e, of.shared
    X, wanted = _design(kind, of.directions, len(e), axis.displaces)
    kept, means, influence = [], [], []
    residual = np.zeros(len(e))
    for number in range(len(axis.centre)):
        rows = np.flatnonzero(axis.bin == number)
        if len(rows) < LEAST_IN_BIN or len(np.unique(shared.frame[rows])) < LEAST_FRAMES:
            continue
        A = np.linalg.pinv(X[rows].T @ X[rows])
        beta = A @ (X[rows].T @ e[rows])
        part = np.zeros(len(e))
        part[rows] = X[rows] @ A[:, wanted]
        residual[rows] = e[rows] - X[rows] @ beta
        kept.append(number)
        means.append(beta[wanted])
        influence.append(part)
    if len(kept) < 2:
        return None
    mean, parts = np.array(means), np.array(influence)
    covariance = shared.covariance(parts, residual, axis)
    statistic, p = _hotelling(mean, covariance, int(shared.frame.max()) + 1)
    count = np.count_nonzero(parts, axis=1).astype(np.int64)
    return ResidualMap(axis, kind, np.array(kept), mean, np.sqrt(np.diag(covariance)), count, statistic, p)


def _hotelling(mean: Array, covariance: Array, clusters: int) -> tuple[float, float]:
    """F statistic and p-value of means (b,) being zero."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    value, vector = np.linalg.eigh(covariance * scale[:, None] * scale)
    kept = value > 0.05
    z = (vector[:, kept].T @ (mean * scale)) / np.sqrt(value[kept])
    b = int(kept.sum())
    free = max(clusters - b, 1)
    statistic = float(z @ z) * free / (b * max(clusters - 1, 1))
    return statistic, float(fdtrc(b, free, statistic))
