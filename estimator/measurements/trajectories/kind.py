"""Trajectories: residuals are those of positions, rotations and spins over their noise, which is its own in every row.

How they are weighed and what they are worth: :mod:`estimator.likelihood.rows`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.estimate import FrameReport
from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap
from estimator.effects.instrument.slow_errors import SlowErrors
from estimator.effects.instrument.unread_lift import UnreadLift
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, fit_campaign
from estimator.likelihood.noise_freedom import as_students
from estimator.likelihood.rows import Rows, robust_cost, shifts_in_time, weighed
from estimator.likelihood.time_shifts import TimeShifts
from estimator.measurements.own_noise import OwnNoise
from estimator.measurements.trajectories.applying import OFTEN_WRONG, why_not, with_plausible_values
from estimator.measurements.trajectories.imagined import Tracks
from estimator.measurements.trajectories.misread_spins import SetAside, misread_spins
from estimator.measurements.trajectories.noise import slow_errors, with_noise
from estimator.measurements.trajectories.noise_floor import trajectory_floor
from estimator.measurements.trajectories.residual_maps import trajectory_maps
from estimator.measurements.trajectories.task import TrajectoryTask, trajectory_errors
from estimator.motion.flight import COM, N_PARAMETERS, Flight

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectories(OwnNoise):
    """The kind of :class:`estimator.measurements.trajectories.task.TrajectoryTask`.

    ``read_once``: whether spins were measured in one row of a flight, by a reading that may be wrong. ``unread``: the lift of flights whose
    reading is set aside, where there are some.
    """

    read_once: bool = False
    unread: UnreadLift | None = None
    slow: SlowErrors | None = None

    @property
    def base(self) -> Model:
        """Free flight, beside lifts of which nothing is known."""
        return Model(tuple(each for each in (self.unread, self.slow) if each is not None))

    def residuals(self, campaign: Campaign, number: int, flight: Flight, model: Model, theta: Array) -> Rows:
        """Residuals, whose derivatives cost little more."""
        return trajectory_errors(campaign.sequences[number], flight, model, theta)

    def equations(self, campaign: Campaign, number: int, residuals: Rows, model: Model, theta: Array) -> SequenceEquations:
        """Residuals, weighed."""
        del model, theta
        sequence = campaign.sequences[number]
        return SequenceEquations(residuals, weighed(residuals, sequence.repeats, as_students(sequence.freedom)))

    def precision(self, sequence: TrajectoryTask) -> Array:
        """None: what is not measured is not varied."""
        del sequence
        return np.zeros(N_PARAMETERS)

    def cost(self, sequence: TrajectoryTask, residuals: Rows) -> float:
        """Huber cost; noise does not depend on the fit."""
        return robust_cost(residuals, sequence.repeats, residuals.rate)

    def sightings(self, sequence: TrajectoryTask) -> int:
        """Rows."""
        return len(sequence.times_s)

    def followed(self, sequence: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> TrajectoryTask:
        """Nothing is made of it."""
        del flight, model, theta
        return sequence

    def relinearised(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """Without spins that were misread; or with the noise that is left about the effects of the model, which counted as noise without.

        What each sequence has of its own, or rows draw anew, takes of the noise whatever it can: about that it is no better known.
        """
        effects = fit.model.effects
        if self.read_once and (aside := misread_spins(campaign, fit)):
            return self._without(campaign, fit, aside)
        if not effects or any(effect.entry.scope.own or effect.random or effect.noise for effect in effects):
            return campaign, fit.state
        try:
            return with_noise(campaign, fit), fit.state
        except InputError:  # made data, of which nothing is left
            return campaign, fit.state

    def ended(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """With slow errors of the tracker, and the noise that is left beside them, where residuals show those beside all that was found.

        Where they are in the fit, with their size anew.
        """
        made = campaign
        if self.slow is None:
            try:
                made = with_noise(campaign, fit)
            except InputError:  # made data, of which nothing is left
                return campaign, fit.state
            fit = fit_campaign(made, fit.state, fit.model)
        slow = slow_errors(made, fit, self.slow)
        if slow is None:
            return campaign, fit.state
        first = self.base.size - (0 if self.slow is None else len(self.slow.held))
        theta = tuple(np.concatenate([each[:first], np.zeros(len(slow.held)), each[self.base.size :]]) for each in fit.state.theta)
        return replace(made, kind=replace(self, slow=slow)), CampaignState(fit.state.flights, theta)

    def _without(self, campaign: Campaign, fit: CampaignFit, aside: SetAside) -> tuple[Campaign, CampaignState]:
        """The campaign without readings that are set ``aside``, and its state: parameters of its base, then those of the effects."""
        kind = replace(self, unread=self.unread or UnreadLift(aside.size))
        new = np.zeros(kind.base.size - self.base.size)
        tasks, flights = list(campaign.sequences), list(fit.state.flights)
        theta = [np.concatenate([new, each]) for each in fit.state.theta]
        for number, lift in aside.lifts.items():
            tasks[number] = tasks[number].with_misread_spin()
            flights[number] = replace(flights[number], omega=np.zeros(3))
            theta[number][: len(lift)] = lift
        return replace(campaign, kind=kind, sequences=tuple(tasks)), CampaignState(tuple(flights), tuple(theta))

    def misses(self, sequence: TrajectoryTask, mean_square: float) -> float:
        """Nothing but a fit shows their noise."""
        del sequence
        return float(np.sqrt(mean_square))

    def with_noise(self, sequence: TrajectoryTask, noise: float) -> TrajectoryTask:
        """With larger standard deviations."""
        return sequence.with_noise(noise)

    def hollow(self, sequence: TrajectoryTask) -> float:
        """No outlines."""
        del sequence
        return 0.0

    def time_shifts(self, campaign: Campaign, number: int, equations: SequenceEquations) -> tuple[TimeShifts, ...]:
        """From the residuals along the motion."""
        return (shifts_in_time(equations),)

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
        """Tracked things may be larger and slower than particles before a camera; what a spin that was read once is wrong by is noise."""
        adapted = with_plausible_values(effect)
        return adapted.as_noise(OFTEN_WRONG) if self.read_once and effect.of_unmeasured_spin else adapted


def _known(values: Array) -> list[float | None]:
    """Values (c,) for a file; none for what was not measured."""
    return [float(value) if np.isfinite(value) else None for value in values]


TRAJECTORIES = Trajectories()
