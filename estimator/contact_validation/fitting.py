"""Free parameters of a contact model from a set of impacts, and what an impact says of a prediction.

An impact counts by its squared Mahalanobis distance d² between measured and predicted (v, omega), six numbers, under the covariance of
their difference; its cost is that of Student's t distribution with :data:`FREEDOM` degrees of freedom, ``(ν+6) ln(1 + d²/ν)``, which is
d² near zero and keeps one odd impact from deciding [Lange, Little & Taylor 1989]. Half the cost is the negative log score.

Impulses scatter from impact to impact by more than what is measured explains: which corner, how sharp, how many. Every model has such a
scatter along the normal, a standard deviation of e, and one along the plate, a share of the tangential impulse; both are fitted with its
parameters, ``C + G diag(s²) Gᵀ`` with the columns of G what each does to (v, omega), and cost ``ln |C + G diag(s²) Gᵀ|``: a model that
misses something pays by the scatter it needs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimator.contact_validation.measured import MeasuredImpact
from estimator.contact_validation.models import ContactModel

Array = NDArray[np.float64]
FREEDOM = 6.0
NUMBERS = 6
"""That an impact gives: v and omega after it."""
MOST_EVALUATIONS = 40
FIRST_SCATTER = np.array([0.02, 0.02])
SCATTERS = np.geomspace(0.01, 0.3, 24)
"""The least is what corners that share an impact make of one restitution; a few runs that agree by luck must not promise less."""
TRIED = np.stack(np.meshgrid(SCATTERS, SCATTERS, indexing="ij"), axis=-1).reshape(-1, 2)
"""Pairs of scatters: of restitution, and of the tangential impulse over itself."""
ROUNDS = 2
"""Of fitting values and scatter in turn."""


@dataclass(frozen=True)
class Impacts:
    """Impacts with the matrices (n, 6, 6) that whiten what is measured less what is predicted.

    ``scattering`` (n, 6, 2): what a restitution that is higher by one, and a tangential impulse that is larger by itself, do to (v, omega),
    whitened.
    """

    measured: tuple[MeasuredImpact, ...]
    whitening: Float[NDArray[np.float64], "impact 6 6"]
    scattering: Float[NDArray[np.float64], "impact 6 2"]

    def __len__(self) -> int:
        return len(self.measured)

    def take(self, rows: Sequence[int]) -> "Impacts":
        """Some of them."""
        return Impacts(tuple(self.measured[k] for k in rows), self.whitening[list(rows)], self.scattering[list(rows)])

    @property
    def after(self) -> Float[NDArray[np.float64], "impact 6"]:
        """Measured v and omega."""
        return np.stack([impact.after for impact in self.measured])


@dataclass(frozen=True)
class Fitted:
    """Values of a model's parameters, their covariance, the scatters of restitution and tangential impulse, and the cost of all impacts."""

    model: ContactModel
    values: Array
    covariance: Array
    scatter: Float[NDArray[np.float64], "2"]
    cost: float

    @property
    def sigmas(self) -> Array:
        """Standard deviations (p,) of the values."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))


def whitening_of(covariances: Array) -> Float[NDArray[np.float64], "impact 6 6"]:
    """Inverse Cholesky factors of covariances (n, 6, 6)."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariances)))


def whitened(impacts: Impacts, model: ContactModel, values: Array) -> Float[NDArray[np.float64], "impact 6"]:
    """Measured less predicted, in standard deviations, no scatter counted."""
    return np.einsum("nij,nj->ni", impacts.whitening, impacts.after - model.predict(impacts.measured, values))


def with_scatter(impacts: Impacts, z: Array, scatter: Array) -> Float[NDArray[np.float64], "impact 6"]:
    """Residuals ``z`` (n, 6) whitened for the scatters (2,), too."""
    return np.einsum("nij,nj->ni", np.linalg.inv(np.linalg.cholesky(np.eye(NUMBERS) + _spread(impacts, scatter))), z)


def _spread(impacts: Impacts, scatter: Array) -> Float[NDArray[np.float64], "impact 6 6"]:
    """What the scatters add to the whitened covariance."""
    part = impacts.scattering * scatter
    return np.asarray(part @ np.swapaxes(part, 1, 2))


def costs_of(impacts: Impacts, z: Array, scatter: Array) -> Float[NDArray[np.float64], " impact"]:
    """Cost of each impact with residuals ``z`` (n, 6) that are whitened but for the scatters (2,)."""
    return np.asarray(_costs(impacts, z, scatter[None])[0])


def _costs(impacts: Impacts, z: Array, scatters: Array) -> Float[NDArray[np.float64], "pair impact"]:
    """The same for pairs of scatters (m, 2), by Woodbury's identity: ``d² = zᵀ z - zᵀ P (1 + Pᵀ P)⁻¹ Pᵀ z`` and ``|1 + Pᵀ P|``."""
    P = impacts.scattering * scatters[:, None, None, :]
    inner = np.eye(2) + np.swapaxes(P, -1, -2) @ P
    along = np.einsum("mnik,ni->mnk", P, z)
    taken = (along * np.linalg.solve(inner, along[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(_bounded(np.maximum((z**2).sum(axis=1) - taken, 0.0)) + np.log(np.linalg.det(inner)))


def _bounded(distances2: Array) -> Array:
    return np.asarray((FREEDOM + NUMBERS) * np.log1p(distances2 / FREEDOM))


def fit(impacts: Impacts, model: ContactModel, known: Sequence[Array] = (), scatter: Array = FIRST_SCATTER) -> Fitted:
    """The values of least cost, from every combination of the parameters' starts, or from the starts ``known``."""
    starts = [np.array(s) for s in product(*(p.starts for p in model.parameters))] if not known else list(known)
    values, _, jacobian = min((_descended(impacts, model, start, scatter) for start in starts), key=lambda found: found[1])
    for _ in range(ROUNDS):
        scatter = best_scatter(impacts, whitened(impacts, model, values))
        values, _, jacobian = _descended(impacts, model, values, scatter)
    cost = float(costs_of(impacts, whitened(impacts, model, values), scatter).sum())
    return Fitted(model, values, np.asarray(np.linalg.pinv(jacobian.T @ jacobian), dtype=np.float64), scatter, cost)


def best_scatter(impacts: Impacts, z: Array) -> Float[NDArray[np.float64], "2"]:
    """The scatters of restitution and tangential impulse under which residuals ``z`` (n, 6) cost least."""
    return np.asarray(TRIED[int(np.argmin(_costs(impacts, z, TRIED).sum(axis=1)))])


def _descended(impacts: Impacts, model: ContactModel, start: Array, scatter: Array) -> tuple[Array, float, Array]:
    """Values of least cost at given scatters, that cost, and the derivatives of its residuals."""
    low, high = (np.array([p.bounds[k] for p in model.parameters]) for k in (0, 1))

    loosened = np.linalg.inv(np.linalg.cholesky(np.eye(NUMBERS) + _spread(impacts, scatter)))

    def residuals(values: Array) -> Array:
        z = np.einsum("nij,nj->ni", loosened, whitened(impacts, model, values))
        d2 = (z**2).sum(axis=1)
        return np.asarray((z * np.sqrt(_bounded(d2) / np.maximum(d2, 1e-12))[:, None]).ravel())

    def jacobian(values: Array) -> Array:
        base = residuals(values)
        steps = np.where(values + size > high, -size, size)
        moved = [residuals(values + step * unit) for step, unit in zip(steps, np.eye(len(values)), strict=True)]
        return np.stack([(m - base) / step for m, step in zip(moved, steps, strict=True)], axis=1)

    size = np.array([p.step for p in model.parameters])
    inside = np.clip(start, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    result = least_squares(
        residuals, inside, jac=jacobian, bounds=(low, high), x_scale=100.0 * size, max_nfev=MOST_EVALUATIONS, xtol=1e-6, ftol=1e-6
    )
    return np.asarray(result.x), float(result.cost), np.asarray(result.jac)
