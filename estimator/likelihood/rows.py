"""Rows of measurements whose noise is their own: weights, misfit and density, where each sequence's noise is known up to a factor.

Residuals are in standard deviations. Noise that is alike in neighbouring rows is counted as often as it repeats: weights are divided by
that number, so that the sum of squares has the size of a likelihood for everything slow, and the gradient's covariance is the normal
matrix itself. The factor has a scaled inverse chi-squared prior [O'Hagan and Forster 2004, ch. 11]; random shifts of the rows' times are
integrated (Woodbury's identity) [Laird and Ware 1982].
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from estimator.appearance.prediction import Prediction
from estimator.likelihood.composite_likelihood import WeighedFrames
from estimator.likelihood.time_shifts import TimeShifts
from estimator.motion.flight import N_PARAMETERS

Array = NDArray[np.float64]
NOISE_FREEDOM = 10.0
"""Degrees of freedom ``nu`` of the prior of a noise's variance: its standard deviation is known to about 20% before the data.

See decision 47."""
HUBER = 4.0
"""Standard deviations beyond which a residual's influence stays constant, as for silhouettes."""


@dataclass(frozen=True)
class Residuals:
    """Residuals ``e`` (n, c) in standard deviations, zero where there is none; ``seen`` (n, c), and more.

    ``variance`` (n, c) of each, in its unit squared; ``noise`` over what was stated or estimated, ``jitter_s`` of the rows' times under the
    model.
    """

    e: Array
    seen: NDArray[np.bool_]
    variance: Array
    prediction: Prediction
    noise: float = 1.0
    jitter_s: float = 0.0


@dataclass(frozen=True)
class Rows(Residuals):
    """Residuals with derivatives ``J`` (n, c, 21 + q) and, by the time of their row, ``rate`` (n, c), 1/s; zero where there is none."""

    rate: Array = field(kw_only=True)
    J: Array = field(kw_only=True)


class Weighed(Protocol):
    """Rows with their weights."""

    @property
    def errors(self) -> Rows:
        """The rows."""

    @property
    def frames(self) -> WeighedFrames:
        """Their weights and normal equations."""


def weighed(errors: Rows, repeats: Array, wider: Array | None = None) -> WeighedFrames:
    """Weights and normal equations, the rows' times being random shifts along ``rate`` as large as the errors have them.

    A residual beyond ``HUBER`` has its variance raised until its influence is that of one at ``HUBER``; a shift is taken off before that is
    judged, and out of the weights (Woodbury's identity) [Laird and Ware 1982].
    ``repeats`` (c,) of the channels; ``wider`` (c,): variance of their noise that intervals have, over that which weighs.
    """
    d = errors.rate * errors.jitter_s
    plain = np.where(errors.seen, 1.0 / repeats, 0.0)
    moved = errors.e - d * _along(plain, d, errors.e) if errors.jitter_s else errors.e
    weight = plain / _beyond(moved)
    J, W = errors.J, weight[..., None] * errors.J
    H = _normal(J, weight, d)
    if errors.jitter_s:
        W = W - ((weight * d) / (1.0 + _squares(weight, d))[:, None])[..., None] * np.einsum("nc,ncp->np", d, W)[:, None]
    spread = H if wider is None or (wider == 1.0).all() else _normal(np.sqrt(wider)[:, None] * J, weight, d)
    g = W.reshape(-1, J.shape[-1]).T @ errors.e.ravel()
    return WeighedFrames(H, g, W, weight, None, spread, np.sum(errors.e**2, axis=1), errors.seen.sum(axis=1))


def _normal(J: Array, weight: Array, d: Array) -> Array:
    """Normal matrix (p, p) of rows ``J`` (n, c, p) of ``weight`` (n, c), random shifts along ``d`` (n, c) out of it."""
    root = (np.sqrt(weight)[..., None] * J).reshape(-1, J.shape[-1])
    H = root.T @ root  # of a matrix with itself, which is half the work
    if d.any():
        root = np.einsum("nc,ncp->np", weight * d, J) / np.sqrt(1.0 + _squares(weight, d))[:, None]
        H -= root.T @ root
    return np.asarray(H)


def _squares(weight: Array, d: Array) -> Array:
    return np.asarray(np.sum(weight * d**2, axis=1))


def _along(plain: Array, d: Array, e: Array) -> Array:
    """Best shift (n, 1) of every row along ``d`` with a prior of variance 1, of weights ``plain`` (n, c) by Huber's cost.

    Its gradient grows along the shift, in straight pieces between where a residual comes to ``HUBER``: the root is in one of them.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        bends = np.concatenate([(e - HUBER) / d, (e + HUBER) / d], axis=1)
    bends = np.sort(np.where(np.isfinite(bends), bends, 0.0), axis=1)
    off = np.clip(e[:, None] - d[:, None] * bends[..., None], -HUBER, HUBER)
    below = np.sum(bends < np.einsum("nc,nbc->nb", plain * d, off), axis=1)[:, None]
    edges = np.concatenate([bends[:, :1] - 1.0, bends, bends[:, -1:] + 1.0], axis=1)
    middle = e - 0.5 * d * (np.take_along_axis(edges, below, axis=1) + np.take_along_axis(edges, below + 1, axis=1))
    inside = np.abs(middle) <= HUBER
    pulled = np.sum(plain * d * np.where(inside, e, HUBER * np.sign(middle)), axis=1)
    return np.asarray((pulled / (1.0 + np.sum(plain * d**2 * inside, axis=1)))[:, None])


def _beyond(e: Array) -> Array:
    """By what the weight of residuals is divided that are beyond ``HUBER``, one of others."""
    return np.maximum(np.abs(e) / HUBER, 1.0)


def robust_cost(errors: Residuals, repeats: Array, rate: Array | None) -> float:
    """Huber's cost with the most probable shift of each row's time; ``repeats`` (c,) of the channels, ``rate`` (n, c) 1/s of the rows.

    No rate is asked for where times are exact.
    """
    e, shift = errors.e, np.zeros(1)
    if rate is not None and errors.jitter_s:
        d = rate * errors.jitter_s
        shift = _along(np.where(errors.seen, 1.0 / repeats, 0.0), d, e)
        e = e - d * shift
    z = np.abs(e)
    near = np.minimum(z, HUBER)
    return float((near * (z - 0.5 * near) / repeats).sum() + 0.5 * (shift**2).sum())


def shifts_in_time(equations: Weighed) -> TimeShifts:
    """Shifts of the rows' times from the residuals along the motion."""
    errors, weight = equations.errors, equations.frames.weight
    h = np.maximum(np.sum(weight * errors.rate**2, axis=1), 1e-150)
    s = np.sum(weight * errors.rate * errors.e, axis=1)
    return TimeShifts(tau_s=-s / h, h=h, noise=np.sum((weight * errors.rate) ** 2, axis=1) / h**2)


def noise_scales(misfits: Array, freedom: Array) -> Array:
    """Noise (s,) over what was stated or estimated, most probable given misfits (s,) of so many degrees of freedom (s,)."""
    return np.asarray(np.sqrt((NOISE_FREEDOM + misfits) / (NOISE_FREEDOM + freedom)))


@dataclass(frozen=True)
class Density:
    """Student's density of the residuals of several sequences, each sequence's noise integrated [O'Hagan and Forster 2004, ch. 11].

    ``misfits``, ``freedom`` (s,) of the sequences; ``constant``: what no misfit changes (nats).
    """

    misfits: Array
    freedom: Array
    constant: float

    def log(self, share: float = 1.0) -> float:
        """Its logarithm (nats) where a ``share`` is left of every misfit."""
        return self.constant - float(np.sum(0.5 * (NOISE_FREEDOM + self.freedom) * np.log1p(share * self.misfits / NOISE_FREEDOM)))


UNKNOWN = Density(np.zeros(0), np.zeros(0), 0.0)
"""The density of what nobody knows the density of."""


@dataclass(frozen=True)
class AtFit:
    """The ``density`` of all residuals at a fit, their weighted ``squares``, and twice what ``priors`` of the instrument cost there.

    ``drawn``: the gain (nats) of what is drawn anew in every frame, if the fit has that: a set has it where it has such an effect.
    """

    density: Density
    squares: float
    priors: float
    drawn: float

    def log_density(self, left: float) -> float:
        """Where so much is ``left`` of squares and priors: a set makes the misfits of all sequences smaller by one factor."""
        share = max(1.0 + (left - self.squares - self.priors) / self.squares, 0.0)
        return self.density.log(share) - 0.5 * self.priors - self.drawn


def density(equations: Sequence[Weighed], misfits: Array, freedom: Array, far_off: float) -> Density:
    """The density with the rows' random shifts in time integrated, over that of numbers of variance one.

    How many independent ones there are depends on the model where noise repeats. ``misfits``, ``freedom`` (s,) of the sequences;
    ``far_off``: squares of what is far off beyond its weighted ones, noise being as the weights have it.
    """
    half = 0.5 * (NOISE_FREEDOM + freedom)
    spread = sum(float(np.sum(np.log1p(_shifted(each)))) for each in equations)
    scale = gammaln(half) - gammaln(0.5 * NOISE_FREEDOM) - 0.5 * freedom * np.log(0.5 * NOISE_FREEDOM)
    return Density(misfits, freedom, float(np.sum(scale)) - 0.5 * (spread + far_off))


def marginal_squares(equations: Weighed) -> float:
    """Weighted sum of squares with the rows' random shifts in time integrated (Woodbury's identity)."""
    errors, weight = equations.errors, equations.frames.weight
    d = errors.rate * errors.jitter_s
    taken = np.sum(weight * d * errors.e, axis=1) ** 2 / (1.0 + _shifted(equations))
    return float(np.sum(weight * errors.e**2) - taken.sum())


def _shifted(equations: Weighed) -> Array:
    """Variance (n,) along the motion that random shifts of the rows' times add, over that of the noise."""
    return np.asarray(np.sum(equations.frames.weight * (equations.errors.rate * equations.errors.jitter_s) ** 2, axis=1))


def degrees_of_freedom(equations: Weighed, repeats: Array) -> float:
    """Independent numbers of a sequence beside those of its own flight: what the marginal squares are where the model is right.

    Of noise that repeats, a row has a part of a number; along the motion, where random times are independent, nearly one.
    ``repeats`` (c,) of the channels.
    """
    errors = equations.errors
    weight = errors.seen / repeats
    square = weight * (errors.rate * errors.jitter_s) ** 2
    shifted = square.sum(axis=1)
    measured = float(weight.sum() + np.sum((shifted - np.sum(weight * square, axis=1)) / (1.0 + shifted)))
    return max(measured - float(np.count_nonzero(np.diag(equations.frames.H)[:N_PARAMETERS] > 0.0)), 1.0)


class Noisy(Protocol):
    """A sequence with its noise over what was stated or estimated, and over how many rows that of each channel (c,) is alike."""

    @property
    def noise(self) -> float:
        """Over what was stated or estimated."""

    @property
    def repeats(self) -> Array:
        """Over so many rows (c,)."""


def misfits(sequences: Sequence[Noisy], equations: Sequence[Weighed]) -> Array:
    """Marginal squares (s,) of sequences in units of the noise that was stated or estimated."""
    return np.array([sequence.noise**2 * marginal_squares(each) for sequence, each in zip(sequences, equations, strict=True)])


def far_off(sequences: Sequence[Noisy], equations: Sequence[Weighed]) -> float:
    """What residuals beyond ``HUBER`` cost by Huber's density more than their weighted squares [Huber 1964].

    Weights are those of one fit: it is by the density that a residual is less probable about another.
    """
    total = 0.0
    for sequence, each in zip(sequences, equations, strict=True):
        plain, weight = np.where(each.errors.seen, 1.0 / sequence.repeats, 0.0), each.frames.weight
        off = (weight < plain) & (weight > 0.0)
        total += float(np.sum(HUBER**2 * plain[off] * (plain[off] / weight[off] - 1.0)))
    return total


def freedoms(sequences: Sequence[Noisy], equations: Sequence[Weighed]) -> Array:
    """Degrees of freedom (s,) of sequences."""
    return np.array([degrees_of_freedom(each, sequence.repeats) for sequence, each in zip(sequences, equations, strict=True)])
