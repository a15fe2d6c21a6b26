"""Random errors of the frames' times: a shift of its own for every sighting, and whether there are any.

One step of each sighting's time alone gives ``tau_i = (d' D e) / (d' D d)``, ``d`` the errors' derivative by the sighting's time and
``D`` the weights. A smooth misfit makes neighbouring shifts alike, jitter does not; so their variance is judged by second differences,
which a smooth misfit does not enter. The likelihood's gain is that of the random-effects model [Laird and Ware 1982]: what the shifts
explain, less the logarithm of what their freedom costs.
"""

from collections.abc import Callable, Sequence
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
    sigma = _likeliest(lambda sigma: gain_of(tau, h, sigma), largest)
    gain = max(gain_of(tau, h, sigma), 0.0)
    sigma = sigma if gain > 0.0 else 0.0
    error = float(np.sum(0.5 * (h / (1.0 + sigma**2 * h)) ** 2 * (2.0 * sigma) ** 2)) ** -0.5 if sigma else 0.0
    return JitterTest(sigma, error, float(norm.sf(z)), gain)


def _likeliest(gain: Callable[[float], float], largest: float) -> float:
    """The jitter (s) up to ``largest`` with the highest gain."""
    best = minimize_scalar(lambda share: -gain(share * largest), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-6})
    return float(best.x) * largest


def held_out_gain(shifts: Sequence[TimeShifts]) -> float:
    """Twice the gain of the log-likelihood of each half of the sequences under the jitter that the other half shows.

    Nobody predicts what is drawn anew in every frame; that it is drawn, and how widely, can be predicted [Gneiting and Raftery 2007 on
    scores of predictions]. Of second differences, which a smooth misfit does not enter. A single sequence is halved.
    """
    if len(shifts) == 1:
        middle = len(shifts[0].tau_s) // 2
        shifts = [shifts[0].take(np.arange(middle)), shifts[0].take(np.arange(middle, len(shifts[0].tau_s)))]
    every = [_differences(each) for each in shifts]
    halves = [tuple(np.concatenate([each[part] for each in every[start::2]]) for part in range(2)) for start in range(2)]
    return sum(_difference_gain(judged, _difference_jitter(learned)) for judged, learned in (halves, halves[::-1]))


def _difference_jitter(differences: tuple[Array, ...]) -> float:
    """The likeliest variance (s²) of jitter."""
    square, _ = differences
    if not len(square):
        return 0.0
    return _likeliest(lambda sigma: _difference_gain(differences, sigma**2), float(np.sqrt(square.max()))) ** 2


def _difference_gain(differences: tuple[Array, ...], jitter: float) -> float:
    square, noise = differences
    wide = noise + 6.0 * jitter
    return float(np.sum(square / noise - square / wide - np.log(wide / noise)))


def _difference_ratios(shifts: TimeShifts) -> Array:
    """Squared second differences over their variances, of neighbours that all carry weight."""
    square, noise = _differences(shifts)
    return square / noise


def _differences(shifts: TimeShifts) -> tuple[Array, Array]:
    """Squared second differences and their variances (s²), of neighbours that all carry weight."""
    rows = np.arange(max(len(shifts.tau_s) - 2, 0))[:, None] + np.arange(3)
    rows = rows[(shifts.noise[rows] > 0.0).all(axis=1)]
    return (shifts.tau_s[rows] @ [1.0, -2.0, 1.0]) ** 2, shifts.noise[rows] @ [1.0, 4.0, 1.0]


def gain_of(tau: Array, h: Array, sigma: float) -> float:
    """Twice the log-likelihood's gain of a jitter ``sigma`` (s) over none."""
    share = sigma**2 * h / (1.0 + sigma**2 * h)
    return float(np.sum(tau**2 * h * share) - np.sum(np.log1p(sigma**2 * h)))
