"""Models judged on impacts that they were not fitted to: folds over runs, and the gain of one model over another beyond chance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.contact_validation.fitting import FREEDOM, Fitted, Impacts, costs_of, fit, volumes_of, whitened, with_scatter

Array = NDArray[np.float64]
FOLDS = 5
"""Parts of the runs that are held out in turn. By judgement."""
RESAMPLES = 4000
"""Sets of runs drawn with replacement; a share of 90% is known to half a per cent by them."""
MEDIAN_DISTANCE2 = 5.348
"""Median of chi-squared with six degrees of freedom."""
CHANCE = 10.0
"""Gain in cost that chance may give, where errors are as stated: 150 to 1 in likelihood, since many additions are tried (notebook 13)."""
LEAST_AGREEMENT = 0.9
"""Share of the resampled sets of runs in which an addition has to gain. By judgement."""
EXPECTED_COST = 7.86
"""Mean of ``(ν+6) ln(1 + d²/ν)`` where d² is chi-squared with six degrees of freedom."""


@dataclass(frozen=True)
class Judged:
    """A fit to all impacts, and each impact (n,) judged by fits to the other runs: ``costs``, and squared ``distances2``.

    Half a cost is the negative log score. ``residuals`` (n, 6): measured less predicted by those fits, m/s and rad/s. ``volumes`` (n,):
    what the scatter of restitution adds to costs, and an uncertainty that is not that of the rigid impulse.
    """

    fitted: Fitted
    costs: Float[NDArray[np.float64], " impact"]
    distances2: Float[NDArray[np.float64], " impact"]
    residuals: Float[NDArray[np.float64], "impact 6"]
    volumes: Float[NDArray[np.float64], " impact"]

    @property
    def expected_cost(self) -> float:
        """Cost of all impacts where the model and its scatter are right, and errors as stated."""
        return float(EXPECTED_COST * len(self.volumes) + self.volumes.sum())

    @property
    def cost(self) -> float:
        """Held-out cost of all impacts."""
        return float(self.costs.sum())

    @property
    def dispersion(self) -> float:
        """How much more than for errors as stated a change of the median residual changes its cost; 1 to 2.1, since costs flatten."""
        median = float(np.median(self.distances2))
        return max(1.0, median / MEDIAN_DISTANCE2 * (FREEDOM + MEDIAN_DISTANCE2) / (FREEDOM + median))


@dataclass(frozen=True)
class Gain:
    """How much lower the held-out cost is: in sum, its 95% interval over resampled runs, and what chance may give.

    ``agreement``: the share of resampled sets of runs in which it is lower at all.
    """

    total: float
    low: float
    high: float
    chance: float
    agreement: float

    @property
    def beyond_chance(self) -> bool:
        """Whether runs agree that it is a gain, and it is larger than what chance gives."""
        return self.total > self.chance and self.agreement > LEAST_AGREEMENT


def folds_of(impacts: Impacts) -> list[list[int]]:
    """Rows left out in turn; impacts of one run stay together."""
    runs = sorted({impact.run for impact in impacts.measured})
    fold = {run: k % FOLDS for k, run in enumerate(runs)}
    parts = [[k for k, impact in enumerate(impacts.measured) if fold[impact.run] == number] for number in range(FOLDS)]
    return [part for part in parts if part]


def judge(impacts: Impacts, fitted: Fitted, starts: Sequence[Array] = ()) -> Judged:
    """Refit without each fold in turn, from the values of the fit to all and from other ``starts``.

    A fit that is compared with another should have had the other's chances: a fold may have several minima.
    ``starts`` (p,) each.
    """
    (costs, distances, volumes), residuals = np.zeros((3, len(impacts))), np.zeros((len(impacts), 6))
    for rows in folds_of(impacts):
        held = impacts.take(rows)
        rest = impacts.take([k for k in range(len(impacts)) if k not in rows])
        refitted = fit(rest, fitted.model, known=(fitted.values, *starts), scatter=fitted.scatter)
        z = whitened(held, fitted.model, refitted.values)
        costs[rows] = costs_of(held, z, refitted.scatter)
        distances[rows] = (with_scatter(held, z, refitted.scatter) ** 2).sum(axis=1)
        volumes[rows] = volumes_of(held, refitted.scatter)
        residuals[rows] = held.after - fitted.model.predict(held.measured, refitted.values)
    return Judged(fitted, costs, distances, residuals, volumes)


def gain(impacts: Impacts, before: Judged, after: Judged, rng: np.random.Generator) -> Gain:
    """Of ``after`` over ``before`` on the same impacts."""
    per_run = by_run(impacts, before.costs - after.costs)
    sums = rng.choice(per_run, size=(RESAMPLES, len(per_run))).sum(axis=1)
    low, high = (float(q) for q in np.quantile(sums, [0.025, 0.975]))
    return Gain(float(per_run.sum()), low, high, CHANCE * after.dispersion, float(np.mean(sums > 0.0)))


def by_run(impacts: Impacts, values: Array) -> Float[NDArray[np.float64], "... run"]:
    """Sums of ``values`` (..., n) over the impacts of each run."""
    runs = np.array([impact.run for impact in impacts.measured])
    return np.stack([values[..., runs == run].sum(axis=-1) for run in sorted(set(runs.tolist()))], axis=-1)
