"""Random errors of the frames' times: a shift of its own for every sighting, and whether there are any.

One step of each sighting's time alone gives ``tau_i = (d' D e) / (d' D d)``, ``d`` the errors' derivative by the sighting's time and
``D`` the weights. A smooth misfit makes neighbouring shifts alike, jitter does not; so their variance is judged by second differences,
which a smooth misfit does not enter. The likelihood's gain is that of the random-effects model [Laird and Ware 1982]: what the shifts
explain, less the logarithm of what their freedom costs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from estimator.fitting.composite_likelihood import WeighedFrames, sighting
from estimator.fitting.model_errors import ModelErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]
DIFFERENCE_VARIANCE = 3.9
"""Variance of a mean of N squared, overlapping second differences of white noise, times N: 2 (1 + 2 (16/36 + 1/36))."""


@dataclass(frozen=True)
class TimeShifts:
    """One-step shifts ``tau_s`` (n,) of the sightings' times, their information ``h`` (n,) and their variance ``noise`` (n,) s²."""

    tau_s: Array
    h: Array
    noise: Array

    def take(self, rows: NDArray[np.int64]) -> "TimeShifts":
        """The sightings ``rows`` alone."""
        return TimeShifts(self.tau_s[rows], self.h[rows], self.noise[rows])


def time_derivative(errors: ModelErrors) -> Array:
    """Derivative (n, k, 2) px/s of the errors by the time of each sighting."""
    rate = np.hstack([errors.prediction.velocity, errors.prediction.omega])
    return np.asarray(np.einsum("nksa,na->nks", errors.tangency.jacobian[:, :, :2, :6], rate))


def time_shifts(errors: ModelErrors, frames: WeighedFrames, first: Silhouettes, *, floor_px: float) -> TimeShifts:
    """Shifts from residuals, with the weights that were used and each silhouette's own noise."""
    d, weight = time_derivative(errors), frames.weight
    n = len(d)
    h, s, noise = np.full(n, 1e-150), np.zeros(n), np.zeros(n)
    for i in np.flatnonzero(errors.tangency.valid.any(axis=1)):
        seen = sighting((errors.e, d[..., None]), errors.tangency, first, i, floor_px=floor_px, huber=np.inf)
        w = weight[i, seen.view, seen.side] * seen.J[:, 0]
        h[i], s[i], noise[i] = max(float(w @ seen.J[:, 0]), 1e-150), float(w @ seen.e), float(w @ seen.Sigma @ w)
    return TimeShifts(tau_s=-s / h, h=h, noise=noise / h**2)


@dataclass(frozen=True)
class JitterTest:
    """Whether frames' times jitter: ``sigma_s`` and its standard error, the p-value, and twice the gain of the log-likelihood."""

    sigma_s: float
    sigma_error_s: float
    p: float
    gain: float


def jitter_test(shifts: Sequence[TimeShifts]) -> JitterTest:
    """Judge the shifts of the sequences of a campaign, each in the order of time."""
    joined = np.concatenate([np.zeros(0), *(_difference_ratios(each) for each in shifts)])
    if not len(joined):
        return JitterTest(0.0, 0.0, 1.0, 0.0)
    z = (joined.mean() - 1.0) / np.sqrt(DIFFERENCE_VARIANCE / len(joined))
    tau, h = (np.concatenate([getattr(s, name) for s in shifts]) for name in ("tau_s", "h"))
    largest = 10.0 * float(np.sqrt(np.mean(tau**2)))
    best = minimize_scalar(lambda sigma: -gain_of(tau, h, sigma), bounds=(0.0, largest), method="bounded")
    gain = max(float(-best.fun), 0.0)
    sigma = float(best.x) if gain > 0.0 else 0.0
    error = float(np.sum(0.5 * (h / (1.0 + sigma**2 * h)) ** 2 * (2.0 * sigma) ** 2)) ** -0.5 if sigma else 0.0
    return JitterTest(sigma, error, float(norm.sf(z)), gain)


def _difference_ratios(shifts: TimeShifts) -> Array:
    """Squared second differences over their variances, of neighbours that all carry weight."""
    rows = np.arange(max(len(shifts.tau_s) - 2, 0))[:, None] + np.arange(3)
    rows = rows[(shifts.noise[rows] > 0.0).all(axis=1)]
    return np.asarray((shifts.tau_s[rows] @ [1.0, -2.0, 1.0]) ** 2 / (shifts.noise[rows] @ [1.0, 4.0, 1.0]))


def gain_of(tau: Array, h: Array, sigma: float) -> float:
    """Twice the log-likelihood's gain of a jitter ``sigma`` (s) over none."""
    share = sigma**2 * h / (1.0 + sigma**2 * h)
    return float(np.sum(tau**2 * h * share) - np.sum(np.log1p(sigma**2 * h)))
