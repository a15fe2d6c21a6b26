"""Free parameters of a contact model from a set of impacts, and what an impact says of a prediction.

An impact counts by its squared Mahalanobis distance d² between measured and predicted (v, omega), six numbers, under the covariance of
their difference; its cost is that of Student's t distribution with :data:`FREEDOM` degrees of freedom, ``(ν+6) ln(1 + d²/ν)``, which keeps
one odd impact from deciding [Lange, Little & Taylor 1989]. Half the cost is the negative log score. Errors are as good as normal all the
same, so the covariance of what is fitted is that of this M-estimator under normal errors [Huber 1981, section 6.3].

Restitution scatters from impact to impact by more than what is measured explains: which corner, how sharp, how many. Every model has such
a scatter, a standard deviation of e that is fitted with its parameters, ``C + s² g gᵀ`` with g what e does to (v, omega), and its cost
``ln |C + s² g gᵀ|``: a model that misses something pays by the scatter it needs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2

from estimator.contact_validation.laws.models import ContactModel
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
FREEDOM = 6.0
"""Degrees of freedom of Student's density of an impact: errors are nearly normal, one odd impact does not decide. By judgement."""
NUMBERS = 6
"""That an impact gives: v and omega after it."""
MOST_EVALUATIONS = 40
"""Of a model's predictions in one descent."""
FIRST_SCATTER = 0.02
"""Standard deviation of restitution from impact to impact with which a fit begins; it is fitted then."""
SCATTERS = np.geomspace(0.01, 0.3, 24)
"""The least is what corners that share an impact make of one restitution; a few runs that agree by luck must not promise less."""
ROUNDS = 2
"""Of fitting values and scatter in turn."""


@dataclass(frozen=True)
class Impacts:
    """Impacts with the matrices (n, 6, 6) that whiten what is measured less what is predicted.

    ``scattering`` (n, 6): what a restitution that is higher by one does to (v, omega), whitened.
    """

    measured: tuple[MeasuredImpact, ...]
    whitening: Float[NDArray[np.float64], "impact 6 6"]
    scattering: Float[NDArray[np.float64], "impact 6"]

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
    """Values of a model's parameters, their covariance, the scatter of restitution, and the cost of all impacts there.

    ``values`` (p,), ``covariance`` (p, p).
    """

    model: ContactModel
    values: Array
    covariance: Array
    scatter: float
    cost: float

    @property
    def sigmas(self) -> Array:
        """Standard deviations (p,) of the values."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def by_name(self) -> dict[str, float]:
        """The values by the parameters' names."""
        return dict(zip(self.model.names, self.values.tolist(), strict=True))

    def for_model(self, model: ContactModel) -> Array:
        """The values of a larger or smaller ``model`` as they are here, with nothing of what this one lacks."""
        known = self.by_name
        return np.array([known.get(name, 0.0) for name in model.names])


def whitened(impacts: Impacts, model: ContactModel, values: Array) -> Float[NDArray[np.float64], "impact 6"]:
    """Measured less predicted, in standard deviations, no scatter counted; ``values`` (p,) of the model's parameters."""
    return np.einsum("nij,nj->ni", impacts.whitening, impacts.after - model.predict(impacts.measured, values))


def with_scatter(impacts: Impacts, z: Array, scatter: float) -> Float[NDArray[np.float64], "impact 6"]:
    """Residuals ``z`` (n, 6) whitened for ``scatter`` of restitution, too."""
    size2 = (impacts.scattering**2).sum(axis=1)
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + scatter**2 * size2)
    along = (impacts.scattering * z).sum(axis=1) / np.maximum(size2, 1e-300)
    return np.asarray(z - (shrink * along)[:, None] * impacts.scattering)


def costs_of(impacts: Impacts, z: Array, scatter: float) -> Float[NDArray[np.float64], " impact"]:
    """Cost of each impact with residuals ``z`` (n, 6) that are whitened but for ``scatter``."""
    return np.asarray(_bounded((with_scatter(impacts, z, scatter) ** 2).sum(axis=1)) + volumes_of(impacts, scatter))


def volumes_of(impacts: Impacts, scatter: float) -> Float[NDArray[np.float64], " impact"]:
    """Part of each impact's cost that is the scatter's own, ``ln |C + s² g gᵀ| - ln |C|``."""
    return np.asarray(np.log1p(scatter**2 * (impacts.scattering**2).sum(axis=1)))


def log_volumes(impacts: Impacts) -> Float[NDArray[np.float64], " impact"]:
    """``ln |C|`` of each impact's covariance without scatter."""
    return np.asarray(-2.0 * np.linalg.slogdet(impacts.whitening)[1])


def _bounded(distances2: Array) -> Array:
    return np.asarray((FREEDOM + NUMBERS) * np.log1p(distances2 / FREEDOM))


def fit(impacts: Impacts, model: ContactModel, known: Sequence[Array] = (), scatter: float = FIRST_SCATTER) -> Fitted:
    """The values of least cost, from every combination of the parameters' starts, or from the starts ``known`` (p,) each."""
    starts = [np.array(s) for s in product(*(p.starts for p in model.parameters))] if not known else list(known)
    values, cost = min((_descended(impacts, model, start, scatter) for start in starts), key=lambda found: found[1])
    for number, parameter in enumerate(model.parameters):
        if parameter.scan:
            values, cost = min((values, cost), _scanned(impacts, model, (values, number), scatter), key=lambda found: found[1])
    for _ in range(ROUNDS):
        scatter = best_scatter(impacts, whitened(impacts, model, values))
        values, _ = _descended(impacts, model, values, scatter)
    cost = float(costs_of(impacts, whitened(impacts, model, values), scatter).sum())
    return Fitted(model, values, _covariance(impacts, model, values, scatter), scatter, cost)


def _covariance(impacts: Impacts, model: ContactModel, values: Array, scatter: float) -> Array:
    """Covariance (p, p) of fitted values: that of least squares, as much larger as the cost that flattens costs in precision."""
    J = _differences(lambda v: with_scatter(impacts, whitened(impacts, model, v), scatter).ravel(), model, values)
    return np.asarray(_loss_of_precision() * np.linalg.pinv(J.T @ J), dtype=np.float64)


@cache
def _loss_of_precision() -> float:
    """Variance of Student's t estimates under normal errors over that of least squares: ``E[w² d²]/6 / E[w (1 - d²/3/(ν+d²))]²``."""
    normal = chi2(NUMBERS)
    scores = normal.expect(lambda d2: ((FREEDOM + NUMBERS) / (FREEDOM + d2)) ** 2 * d2 / NUMBERS)
    slope = normal.expect(lambda d2: (FREEDOM + NUMBERS) / (FREEDOM + d2) * (1.0 - 2.0 * d2 / NUMBERS / (FREEDOM + d2)))
    return float(scores / slope**2)


def _differences(of: Callable[[Array], Array], model: ContactModel, values: Array) -> Array:
    """Derivatives (n, p) by differences that stay within the parameters' bounds."""
    size, high = np.array([p.step for p in model.parameters]), np.array([p.bounds[1] for p in model.parameters])
    base, steps = of(values), np.where(values + size > high, -size, size)
    moved = [of(values + step * unit) for step, unit in zip(steps, np.eye(len(values)), strict=True)]
    return np.stack([(m - base) / step for m, step in zip(moved, steps, strict=True)], axis=1)


def _scanned(impacts: Impacts, model: ContactModel, at: tuple[Array, int], scatter: float) -> tuple[Array, float]:
    """The minimum beside the likeliest of the values that one parameter is scanned at, the others as they are."""
    values, number = at
    tried = np.repeat(values[None], len(model.parameters[number].scan), axis=0)
    tried[:, number] = model.parameters[number].scan
    costs = [costs_of(impacts, whitened(impacts, model, each), scatter).sum() for each in tried]
    return _descended(impacts, model, tried[int(np.argmin(costs))], scatter)


def best_scatter(impacts: Impacts, z: Array) -> float:
    """The scatter of restitution under which residuals ``z`` (n, 6) cost least."""
    return float(SCATTERS[int(np.argmin([costs_of(impacts, z, s).sum() for s in SCATTERS]))])


def _descended(impacts: Impacts, model: ContactModel, start: Array, scatter: float) -> tuple[Array, float]:
    """Values of least cost at a given scatter, and that cost."""
    low, high = (np.array([p.bounds[k] for p in model.parameters]) for k in (0, 1))

    def residuals(values: Array) -> Array:
        z = with_scatter(impacts, whitened(impacts, model, values), scatter)
        d2 = (z**2).sum(axis=1)
        return np.asarray((z * np.sqrt(_bounded(d2) / np.maximum(d2, 1e-12))[:, None]).ravel())

    def jacobian(values: Array) -> Array:
        return _differences(residuals, model, values)

    size = np.array([p.step for p in model.parameters])
    inside = np.clip(start, low + 1e-6 * (high - low), high - 1e-6 * (high - low))
    result = least_squares(
        residuals, inside, jac=jacobian, bounds=(low, high), x_scale=100.0 * size, max_nfev=MOST_EVALUATIONS, xtol=1e-6, ftol=1e-6
    )
    return np.asarray(result.x), float(result.cost)
