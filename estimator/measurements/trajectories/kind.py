"""Trajectories: residuals are those of positions, rotations and spins over their noise, which is its own in every row.

Noise that is alike in neighbouring rows is counted as often as it repeats: weights are divided by that number, so that the sum of squares
has the size of a likelihood for everything slow, and the gradient's covariance is the normal matrix itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from datasets.estimate import FrameReport
from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, SequenceEquations
from estimator.fitting.campaigns.measurement_kind import NOISE_FREEDOM
from estimator.likelihood.composite_likelihood import WeighedFrames
from estimator.likelihood.time_shifts import TimeShifts
from estimator.measurements.trajectories.applying import why_not, with_plausible_values
from estimator.measurements.trajectories.imagined import Tracks
from estimator.measurements.trajectories.noise_floor import trajectory_floor
from estimator.measurements.trajectories.residual_maps import trajectory_maps
from estimator.measurements.trajectories.task import TrajectoryErrors, TrajectoryTask, trajectory_errors
from estimator.motion.flight import COM, N_PARAMETERS, Flight

Array = NDArray[np.float64]
HUBER = 4.0
"""Standard deviations beyond which a residual's influence stays constant, as for silhouettes."""


@dataclass(frozen=True)
class Trajectories:
    """The kind of :class:`estimator.measurements.trajectories.task.TrajectoryTask`."""

    unit: str = "σ"

    @property
    def base(self) -> Model:
        """Free flight alone."""
        return Model(())

    def residuals(self, campaign: Campaign, number: int, flight: Flight, model: Model, theta: Array) -> TrajectoryErrors:
        """Residuals, whose derivatives cost little more."""
        return trajectory_errors(campaign.sequences[number], flight, model, theta)

    def equations(self, campaign: Campaign, number: int, residuals: TrajectoryErrors, model: Model, theta: Array) -> SequenceEquations:
        """Residuals, weighed."""
        jitter_s = model.random_sigma(theta)
        return SequenceEquations(replace(residuals, jitter_s=jitter_s), weighed(residuals, campaign.sequences[number].repeats, jitter_s))

    def precision(self, sequence: TrajectoryTask) -> Array:
        """None: what is not measured is not varied."""
        del sequence
        return np.zeros(N_PARAMETERS)

    def cost(self, sequence: TrajectoryTask, residuals: TrajectoryErrors, like: TrajectoryErrors | None = None) -> float:
        """Huber cost; noise does not depend on the fit."""
        del like
        z = np.abs(residuals.e)
        near = np.minimum(z, HUBER)
        rho = near * (z - 0.5 * near)
        return float((rho / sequence.repeats).sum())

    def repeated_noise(
        self,
        campaign: Campaign,
        errors: Sequence[TrajectoryErrors],
        weighted: Sequence[Array],
        like: Sequence[TrajectoryErrors] | None = None,
    ) -> Array:
        """None: every row has its own."""
        del campaign, errors, like
        return np.zeros((weighted[0].shape[-1],) * 2)

    def sightings(self, sequence: TrajectoryTask) -> int:
        """Rows."""
        return len(sequence.times_s)

    def only(self, sequence: TrajectoryTask, kept: NDArray[np.bool_]) -> TrajectoryTask:
        """Other rows have no residuals."""
        return replace(sequence, kept=sequence.kept & kept)

    def followed(self, sequence: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> TrajectoryTask:
        """Nothing is made of it."""
        del flight, model, theta
        return sequence

    def noise_scales(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> Array | None:
        """Of a flight whose residuals are larger than all others', a hand's or a bad track's, the noise is larger, not the effects."""
        freedom = np.array([_freedom(task, each) for task, each in zip(campaign.sequences, equations, strict=True)])
        return np.sqrt((NOISE_FREEDOM + _misfits(campaign, equations)) / (NOISE_FREEDOM + freedom))

    def noise_of(self, sequence: TrajectoryTask) -> float:
        """As it is in the sequence's standard deviations."""
        return sequence.noise

    def with_noise(self, sequence: TrajectoryTask, noise: float) -> TrajectoryTask:
        """With larger standard deviations."""
        return sequence.with_noise(noise)

    def log_density(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> float:
        """Student's density of every sequence [O'Hagan and Forster 2004, ch. 11], its rows' random shifts in time integrated.

        Over that of numbers of variance one: how many independent ones there are depends on the model where noise repeats.
        """
        n = np.array([_freedom(task, each) for task, each in zip(campaign.sequences, equations, strict=True)])
        half, misfits = 0.5 * (NOISE_FREEDOM + n), _misfits(campaign, equations)
        spread = sum(float(np.sum(np.log1p(_shifted(each)))) for each in equations)
        scale = gammaln(half) - gammaln(0.5 * NOISE_FREEDOM) - 0.5 * n * np.log(0.5 * NOISE_FREEDOM)
        return float(np.sum(scale - half * np.log1p(misfits / NOISE_FREEDOM))) - 0.5 * spread

    def squares(self, equations: Sequence[SequenceEquations]) -> float:
        """Of what random shifts of the rows' times do not explain."""
        return sum(_marginal(each) for each in equations)

    def hollow(self, sequence: TrajectoryTask) -> float:
        """No outlines."""
        del sequence
        return 0.0

    def time_shifts(self, campaign: Campaign, number: int, equations: SequenceEquations) -> TimeShifts:
        """From the residuals along the motion."""
        errors, weight = equations.errors, equations.frames.weight
        h = np.maximum(np.sum(weight * errors.rate**2, axis=1), 1e-150)
        s = np.sum(weight * errors.rate * errors.e, axis=1)
        return TimeShifts(tau_s=-s / h, h=h, noise=np.sum((weight * errors.rate) ** 2, axis=1) / h**2)

    def noise_ratio(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> float:
        """One: the noise is given, or estimated from the rows themselves."""
        del campaign, equations
        return 1.0

    def why_not(self, campaign: Campaign, effect: EffectModel) -> str | None:
        """Effects on pictures, and those on what was not measured, do not apply."""
        return why_not(effect, campaign.sequences)

    def noise_floor(self, campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
        """Against noise that changes from row to row."""
        return trajectory_floor(campaign, fit, rng)

    def residual_maps(self, campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
        """Of positions and turns."""
        return trajectory_maps(campaign, fit)

    def imagination(self, campaign: Campaign, number: int, fit: CampaignFit, particles: Sequence[Any]) -> Tracks:
        """Rows like the measured ones."""
        del particles
        return Tracks(campaign.sequences[number], fit.state.flights[number], fit.model, fit.state.theta[number])

    def statistics(self, equations: SequenceEquations) -> dict[str, Any]:
        """RMS of the residuals, each channel in its own unit, and of its noise."""
        errors = equations.errors
        measured = errors.seen.any(axis=0)
        sigma, count = np.sqrt(np.where(errors.seen, errors.variance, 0.0)), np.maximum(errors.seen.sum(axis=0), 1)
        rms = np.where(measured, np.sqrt(np.sum((errors.e * sigma) ** 2, axis=0) / count), np.nan)
        noise = np.where(measured, sigma.sum(axis=0) / count, np.nan)
        return {"rows": len(errors.e), "rms": _known(rms), "noise": _known(noise)}

    def frame_reports(self, sequence: TrajectoryTask, observation: Any, equations: SequenceEquations) -> tuple[FrameReport, ...]:
        """Every row; there is no picture whose error could be told in pixels."""
        del sequence, observation
        whitened = np.sqrt(equations.frames.chi2 / np.maximum(equations.frames.count, 1))
        return tuple(FrameReport(0, row, True, "", 0.0, float(value)) for row, value in enumerate(whitened))

    def unmeasured(self, sequence: TrajectoryTask) -> NDArray[np.int64]:
        """Orientation and spin, where they are not varied; the body is stated."""
        state = np.arange(N_PARAMETERS) < COM.start
        return np.flatnonzero(sequence.still & state).astype(np.int64)

    def adapted(self, effect: EffectModel) -> EffectModel:
        """Tracked things may be larger and slower than particles before a camera."""
        return with_plausible_values(effect)


def _known(values: Array) -> list[float | None]:
    """Values (c,) for a file; none for what was not measured."""
    return [float(value) if np.isfinite(value) else None for value in values]


TRAJECTORIES = Trajectories()


def _misfits(campaign: Campaign, equations: Sequence[SequenceEquations]) -> Array:
    """Weighted sums of squares (s,) in units of the noise that was stated or estimated."""
    squares = [_marginal(each) for each in equations]
    return np.array([task.noise**2 * each for task, each in zip(campaign.sequences, squares, strict=True)])


def _marginal(equations: SequenceEquations) -> float:
    """Weighted sum of squares with the rows' random shifts in time integrated (Woodbury's identity)."""
    errors, weight = equations.errors, equations.frames.weight
    d = errors.rate * errors.jitter_s
    taken = np.sum(weight * d * errors.e, axis=1) ** 2 / (1.0 + _shifted(equations))
    return float(np.sum(weight * errors.e**2) - taken.sum())


def _shifted(equations: SequenceEquations) -> Array:
    """Variance (n,) along the motion that random shifts of the rows' times add, over that of the noise."""
    return np.asarray(np.sum(equations.frames.weight * (equations.errors.rate * equations.errors.jitter_s) ** 2, axis=1))


def _freedom(task: TrajectoryTask, equations: SequenceEquations) -> float:
    """Independent numbers of a sequence beside those of its own flight: what :func:`_marginal` is expected to be where the model is right.

    Of noise that repeats, a row has a part of a number; along the motion, where random times are independent, nearly one.
    """
    errors = equations.errors
    weight = errors.seen / task.repeats
    square = weight * (errors.rate * errors.jitter_s) ** 2
    shifted = square.sum(axis=1)
    measured = float(weight.sum() + np.sum((shifted - np.sum(weight * square, axis=1)) / (1.0 + shifted)))
    return max(measured - float(np.count_nonzero(np.diag(equations.frames.H)[:N_PARAMETERS] > 0.0)), 1.0)


def weighed(errors: TrajectoryErrors, repeats: Array, jitter_s: float) -> WeighedFrames:
    """Weights and normal equations; ``jitter_s``: standard deviation of the rows' times, a random shift along ``rate``.

    A residual beyond ``HUBER`` has its variance raised until its influence is that of one at ``HUBER``; a shift is taken off before that is
    judged, and out of the weights (Woodbury's identity) [Laird and Ware 1982].
    ``repeats`` (c,) of the channels.
    """
    d = errors.rate * jitter_s
    plain = np.where(errors.seen, 1.0 / repeats, 0.0)
    moved = errors.e - d * _along(plain, d, errors.e)
    weight = plain / np.maximum(np.abs(moved) / HUBER, 1.0)
    W = weight[..., None] * errors.J
    if jitter_s:
        gain = 1.0 / (1.0 + np.sum(weight * d**2, axis=1))
        W = W - (weight * d)[..., None] * (gain[:, None] * np.einsum("nc,ncp->np", d, W))[:, None]
    J = errors.J.reshape(-1, errors.J.shape[-1])
    flat = W.reshape(J.shape)
    H = J.T @ flat
    H = 0.5 * (H + H.T)
    count = errors.seen.sum(axis=1)
    return WeighedFrames(H, flat.T @ errors.e.ravel(), W, weight, None, H, np.sum(errors.e**2, axis=1), count)


def _along(weight: Array, d: Array, e: Array) -> Array:
    """Best shift (n, 1) of every row along ``d`` with a prior of variance 1."""
    return np.asarray((np.sum(weight * d * e, axis=1) / (1.0 + np.sum(weight * d**2, axis=1)))[:, None])
