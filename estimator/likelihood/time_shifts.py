"""Random errors of the frames' times: a shift of its own for every sighting, and whether there are any.

One step of each sighting's time alone gives ``tau_i = (d' D e) / (d' D d)``, ``d`` the errors' derivative by the sighting's time and
``D`` the weights. A smooth misfit makes neighbouring shifts alike, jitter does not; so their variance is judged by second differences,
which a smooth misfit does not enter, each by as much as jitter can show in it: fast sequences count most. The likelihood's gain is that
of the random-effects model [Laird and Ware 1982]: what the shifts explain, less the logarithm of what their freedom costs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.optimize import brentq, minimize_scalar
from scipy.special import chdtrc, chdtri

from estimator.appearance.model_errors import ModelErrors
from estimator.geometry.robust_scale import robust_sigma
from estimator.geometry.silhouettes import Silhouettes
from estimator.likelihood.alike_noise import channel_noise
from estimator.likelihood.composite_likelihood import Sighting, WeighedFrames, sighting

Array = NDArray[np.float64]
DIFFERENCE_VARIANCE = 3.9
"""Variance of a mean of N squared, overlapping second differences of white noise, times N: 2 (1 + 2 (16/36 + 1/36))."""
INDEPENDENT_DIFFERENCES = 2.0 / DIFFERENCE_VARIANCE
"""Of overlapping second differences: as many squares vary as the mean of all does (notebook 31)."""
DIFFERENCE_GAIN = 6.0
"""Variance of a second difference over that of what is differenced: 1 + 4 + 1."""
NEIGHBOURS = np.array([[1], [1], [0], [1], [1]])
"""Sightings whose median movement says where the middle one would be: a smooth misfit makes no outliers. Beyond an end they are mirrored:
the last one itself would say that it is where it should be."""
FAR_OFF = 6.0
"""Robust standard deviations from there, while wrong outlines are off by tens. Of 6 to 10 outlines with normal errors one in a hundred
is as far, of 30 fewer than one in a thousand: few outlines tell their standard deviation badly (a test says how often)."""
WIDEST = 8.0
"""Logarithm of how far from the noise of differences, by what they tell, a jitter is looked for."""


@dataclass(frozen=True)
class TimeShifts:
    """One-step shifts ``tau_s`` (n,) of the sightings' times, their information ``h`` (n,) and their variance ``noise`` (n,) s².

    ``still`` (n, c): one-step movements of the same sightings over their standard deviations, of which a shift of the time is no part.
    ``stretch`` (n,): such a stretch along the motion, which moves opposite tangents apart by as much as a shift moves them together.
    """

    tau_s: Array
    h: Array
    noise: Array
    still: Array | None = None
    stretch: Array | None = None

    def take(self, rows: NDArray[np.int64]) -> "TimeShifts":
        """The sightings ``rows`` (k,) alone."""
        still, stretch = (None if each is None else each[rows] for each in (self.still, self.stretch))
        return TimeShifts(self.tau_s[rows], self.h[rows], self.noise[rows], still, stretch)


def calibrated(shifts: Sequence[TimeShifts]) -> list[TimeShifts]:
    """The shifts with as much noise as other movements of the sightings show, and a standard error more: tests must not be eager.

    An empirical null [Efron 2004]: what neighbouring tangents share differs from body to body, by a third either way; and edges blurred
    by the motion are noisier along it, which a stretch along the motion shows as shifts of the time do, each sequence by as much as
    jitter can show in it.
    """
    more = max(_with_an_error(*_movements_noise(shifts)), _with_an_error(*_stretch_noise(shifts))) or 1.0
    return [replace(each, h=each.h / more, noise=each.noise * more) for each in shifts]


def without_outliers(shifts: TimeShifts) -> TimeShifts:
    """The shifts without weight where a sighting is off as a whole: one that moved far across the motion says nothing of the time."""
    told = shifts.noise > 0.0
    if shifts.still is None or told.sum() <= len(NEIGHBOURS):
        return shifts
    off = from_neighbours(shifts.still)
    far = off.max(axis=1) > FAR_OFF * float(robust_sigma(off[told].ravel()))
    kept = np.where(far, 0.0, 1.0)
    return replace(shifts, tau_s=shifts.tau_s * kept, h=np.where(far, 1e-150, shifts.h), noise=shifts.noise * kept)


def from_neighbours(movements: Array) -> Array:
    """How far movements (n, c) of sightings in the order of time are from where those beside each would have it."""
    return np.asarray(np.abs(movements - median_filter(movements, footprint=NEIGHBOURS, mode="mirror")))


def _with_an_error(ratio: float, freedom: float) -> float:
    """A ratio of variances, a standard error more."""
    return ratio * (1.0 + np.sqrt(2.0 / freedom)) if ratio > 0.0 else 0.0


def noise_ratio(shifts: Sequence[TimeShifts]) -> float:
    """Noise of the sightings over what its model says, 1 at least, from movements that have nothing to do with time."""
    return max(_movements_noise(shifts)[0], 1.0)


def likeness(shifts: Sequence[TimeShifts]) -> float:
    """Over how many sightings their noise is alike, from movements that have nothing to do with time.

    Their size is modelled: what is larger, a slow misfit or a body-fixed error, is none of it.
    """
    noise = channel_noise([column for each in shifts if each.still is not None for column in each.still.T], stated=True)
    return 1.0 if noise is None else noise.repeats


def _movements_noise(shifts: Sequence[TimeShifts]) -> tuple[float, float]:
    """Mean square of second differences, which no smooth misfit enters, of movements but by time, over what is modelled; its freedom.

    The movements of a sighting share its tangents: as many degrees of freedom as one of them has. Zero where there is none.
    """
    ratios, count = [np.zeros(0)], 0
    for each in shifts:
        sure = np.where(each.noise > 0.0, 1.0, 0.0)
        count += len(_differences(each.tau_s, each.noise)[0])
        ratios += [np.divide(*_differences(column, sure)) for column in (each.still.T if each.still is not None else ())]
    every = np.concatenate(ratios)
    return (float(every.mean()), 2.0 * count / DIFFERENCE_VARIANCE) if len(every) else (0.0, 1.0)


def _stretch_noise(shifts: Sequence[TimeShifts]) -> tuple[float, float]:
    """The same of stretches along the motion, weighed as shifts of the time are by the test."""
    known = [each for each in shifts if each.stretch is not None]
    squares = [np.divide(*_differences(each.stretch, np.where(each.noise > 0.0, 1.0, 0.0))) for each in known if each.stretch is not None]
    weights = np.concatenate([np.zeros(0), *(1.0 / _differences(each.tau_s, each.noise)[1] for each in known)])
    return (float(weights @ np.concatenate(squares) / weights.sum()), _freedom(weights)) if len(weights) else (0.0, 1.0)


def time_derivative(errors: ModelErrors) -> Array:
    """Derivative (n, k, 2) px/s of the errors by the time of each sighting."""
    rate = np.hstack([errors.prediction.velocity, errors.prediction.omega])
    return np.asarray(np.einsum("nksa,na->nks", errors.tangency.jacobian[:, :, :2, :6], rate))


def time_shifts(errors: ModelErrors, frames: WeighedFrames, first: Silhouettes, *, floor_px: float) -> TimeShifts:
    """Shifts from residuals, with the weights that were used and each silhouette's own noise."""
    by_pose, rate = errors.tangency.jacobian[:, :, :2, :6], np.hstack([errors.prediction.velocity, errors.prediction.omega])
    n = len(rate)
    h, s, noise, still, stretch = np.full(n, 1e-150), np.zeros(n), np.zeros(n), np.zeros((n, 6)), np.zeros(n)
    for i in errors.tangency.telling:
        seen = sighting((errors.e, by_pose), errors.tangency, first, i, floor_px=floor_px, huber=np.inf)
        W = frames.weight[i, seen.view, seen.side][:, None] * seen.J
        A, B, score = W.T @ seen.J, W.T @ seen.Sigma @ W, W.T @ seen.e
        r = rate[i]
        h[i], s[i], noise[i] = max(float(r @ A @ r), 1e-150), float(r @ score), float(r @ B @ r)
        apart = np.eye(6) - np.outer(r, B @ r) / max(noise[i], 1e-150)  # what noise makes of these scores, and of time's, is uncorrelated
        still[i] = (score @ apart) / np.sqrt(np.maximum(np.einsum("ac,ab,bc->c", apart, B, apart), 1e-150))
        stretch[i] = _stretch(W @ r, np.where(seen.side == 0, 1.0, -1.0), seen)
    return TimeShifts(tau_s=-s / h, h=h, noise=noise / h**2, still=still, stretch=stretch)


def _stretch(along: Array, opposite: Array, seen: Sighting) -> float:
    """Score of opposite tangents' moving apart, over its standard deviation; what noise makes of it and of the shift's is uncorrelated."""
    apart = along * opposite
    shared = float(along @ seen.Sigma @ apart) / max(float(along @ seen.Sigma @ along), 1e-150)
    apart = apart - shared * along
    return float(apart @ seen.e) / max(float(apart @ seen.Sigma @ apart), 1e-150) ** 0.5


@dataclass(frozen=True)
class JitterTest:
    """Whether frames' times jitter: ``sigma_s`` and its standard error, the p-value, and what it explains.

    ``gain``: twice that of the log-likelihood of second differences, of which overlapping ones count once. A smooth misfit, which shifts
    of the times could take up as well, is no part of it.
    """

    sigma_s: float
    sigma_error_s: float
    p: float
    gain: float


def jitter_test(shifts: Sequence[TimeShifts]) -> JitterTest:
    """Judge the shifts of the sequences of a campaign, each in the order of time."""
    shifts = calibrated([without_outliers(each) for each in shifts])
    squares, noises = (np.concatenate(parts) for parts in zip(*(_differences(each.tau_s, each.noise) for each in shifts), strict=True))
    if not len(squares):
        return JitterTest(0.0, 0.0, 1.0, 0.0)
    p = _excess_p(squares / noises, 1.0 / noises)
    gain = INDEPENDENT_DIFFERENCES * max(_difference_gain((squares, noises), _difference_jitter((squares, noises))), 0.0)
    tau, h = (np.concatenate([getattr(s, name) for s in shifts]) for name in ("tau_s", "h"))
    largest = 10.0 * float(np.sqrt(np.mean(tau**2)))
    sigma = _likeliest(lambda sigma: gain_of(tau, h, sigma), largest)
    sigma = sigma if gain_of(tau, h, sigma) > 0.0 else 0.0
    error = float(np.sum(0.5 * (h / (1.0 + sigma**2 * h)) ** 2 * (2.0 * sigma) ** 2)) ** -0.5 if sigma else np.inf
    error = min(error, _profile_error(tau, h, sigma))
    return JitterTest(sigma, error, p, gain)


def _profile_error(tau: Array, h: Array, sigma: float) -> float:
    """By how much more a jitter is one unit less likely in twice the logarithm: at zero there is no curvature to tell it; s.

    ``tau`` (n,) s, ``h`` (n,) 1/s²: shifts of the times and their information.
    """
    best, step = gain_of(tau, h, sigma), float(np.median(h)) ** -0.5
    while best - gain_of(tau, h, sigma + step) < 1.0:
        step *= 2.0
    return float(brentq(lambda more: best - gain_of(tau, h, sigma + more) - 1.0, 0.0, step))


def jitter_found_with(shifts: Sequence[TimeShifts], p: float, probability: float) -> float:
    """Jitter (s) of which :func:`jitter_test` gives a p-value below ``p`` with a ``probability``; infinite where shifts say nothing."""
    noises = np.concatenate([_differences(each.tau_s, each.noise)[1] for each in calibrated([without_outliers(s) for s in shifts])])
    if not len(noises):
        return float("inf")

    def missed(logarithm: float) -> float:
        return probability - _found_share(noises, np.exp(2.0 * logarithm), p)

    middle = -0.5 * np.log(float(np.mean(1.0 / noises)))
    return float(np.exp(brentq(missed, middle - WIDEST, middle + WIDEST)))


def _found_share(noises: Array, jitter: float, p: float) -> float:
    """How often a jitter of the variance ``jitter`` (s²) passes the level ``p``, the weighted mean of ratios a scaled chi-squared again."""
    weights, growth = 1.0 / noises, 1.0 + DIFFERENCE_GAIN * jitter / noises
    freedom = _freedom(weights)
    threshold = float(chdtri(freedom, p)) / freedom
    mean, freedom = float(weights @ growth / weights.sum()), _freedom(weights * growth)
    return float(chdtrc(freedom, freedom * threshold / mean))


def _freedom(weights: Array) -> float:
    """Degrees of freedom of a chi-squared that varies as a weighted sum of squared second differences does [Satterthwaite 1946]."""
    return 2.0 * float(weights.sum() ** 2 / (weights @ weights)) / DIFFERENCE_VARIANCE


def _excess_p(ratios: Array, weights: Array) -> float:
    """Of a weighted mean of squared second differences over their variances that is as large, where there is noise alone.

    Jitter adds to a ratio in proportion to the weight: no weighted mean shows little of it better [Neyman 1959]. The mean is as a
    chi-squared of as many degrees of freedom as give its variance [Satterthwaite 1946].
    """
    mean = float(weights @ ratios / weights.sum())
    freedom = _freedom(weights)
    return float(chdtrc(freedom, freedom * mean))


def _likeliest(gain: Callable[[float], float], largest: float) -> float:
    """The jitter (s) up to ``largest`` with the highest gain."""
    best = minimize_scalar(lambda share: -gain(share * largest), bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-6})
    return float(best.x) * largest


def _difference_jitter(differences: tuple[Array, ...]) -> float:
    """The likeliest variance (s²) of jitter."""
    square, _ = differences
    if not len(square):
        return 0.0
    return _likeliest(lambda sigma: _difference_gain(differences, sigma**2), float(np.sqrt(square.max()))) ** 2


def _difference_gain(differences: tuple[Array, ...], jitter: float) -> float:
    square, noise = differences
    wide = noise + DIFFERENCE_GAIN * jitter
    return float(np.sum(square / noise - square / wide - np.log(wide / noise)))


def _differences(values: Array, noise: Array) -> tuple[Array, Array]:
    """Squared second differences of ``values`` (n,) of variances ``noise`` (n,), and their variances, where all three carry weight."""
    rows = np.arange(max(len(values) - 2, 0))[:, None] + np.arange(3)
    rows = rows[(noise[rows] > 0.0).all(axis=1)]
    return (values[rows] @ [1.0, -2.0, 1.0]) ** 2, noise[rows] @ [1.0, 4.0, 1.0]


def gain_of(tau: Array, h: Array, sigma: float) -> float:
    """Twice the log-likelihood's gain of a jitter ``sigma`` (s) over none.

    ``tau`` (n,) s, ``h`` (n,) 1/s²: shifts of the times and their information.
    """
    share = sigma**2 * h / (1.0 + sigma**2 * h)
    return float(np.sum(tau**2 * h * share) - np.sum(np.log1p(sigma**2 * h)))
