"""Silhouettes in pictures: residuals are tangency errors in pixels, with noise of the outlines, of the calibrated views and of the body."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, SequenceEquations
from estimator.fitting.campaign_noise import repeated_noise
from estimator.fitting.composite_likelihood import RandomShift, weigh_linear
from estimator.fitting.model_errors import ModelErrors, SequenceTask, model_errors
from estimator.fitting.time_shifts import TimeShifts, time_derivative, time_shifts
from estimator.motion.flight import Flight

Array = NDArray[np.float64]
INDEPENDENT_TANGENTS = 12.0
"""Roughly how many independent tangents an outline has, for the ratio of data to prior in the step control and for penalties."""


@dataclass(frozen=True)
class Silhouettes:
    """The kind of :class:`estimator.fitting.model_errors.SequenceTask`."""

    unit: str = "px"

    @property
    def base(self) -> Model:
        """Free flight with the instrument's known discrepancy."""
        return Model((CurvatureBias(),))

    def equations(self, campaign: Campaign, number: int, flight: Flight, model: Model, theta: Array) -> SequenceEquations:
        """Tangency errors, weighed."""
        sequence = campaign.sequences[number]
        errors = model_errors(sequence, flight, model, theta)
        sigma = model.random_sigma(theta)
        frames = weigh_linear(
            (errors.e, errors.J),
            errors.tangency,
            sequence.task.sightings.silhouettes,
            floor_px=campaign.floor_px,
            huber=sequence.task.huber,
            shift=RandomShift(time_derivative(errors), sigma) if sigma else None,
        )
        return SequenceEquations(errors, frames)

    def precision(self, sequence: SequenceTask) -> Array:
        """What the hull says of the body, and what is believed of outlines."""
        return sequence.task.prior.precision

    def cost(self, sequence: SequenceTask, equations: SequenceEquations) -> float:
        """Huber cost on the scale of the weights: each sighting's mean error counts as often as it is independent."""
        errors, huber = equations.errors, sequence.task.huber
        z = np.abs(errors.e) / np.sqrt(errors.tangency.variance[:, :, :2])
        rho = np.where(z <= huber, 0.5 * z**2, huber * z - 0.5 * huber**2)
        return float((rho * errors.seen).sum() / max(errors.seen.sum(axis=(1, 2)).mean(), 1.0) * INDEPENDENT_TANGENTS)

    def repeated_noise(self, campaign: Campaign, errors: Sequence[ModelErrors], weighted: Sequence[Array]) -> Array:
        """That of the calibrated views and of the body."""
        return repeated_noise(campaign, errors, weighted)

    def sightings(self, sequence: SequenceTask) -> int:
        """Outlines in use."""
        return len(sequence.task.sightings)

    def only(self, sequence: SequenceTask, kept: NDArray[np.bool_]) -> SequenceTask:
        """Pairs of the other sightings get no weight."""
        weight = np.where(kept[:, None], sequence.task.weight, 0.0)
        return replace(sequence, task=replace(sequence.task, weight=weight))

    def time_shifts(self, campaign: Campaign, number: int, equations: SequenceEquations) -> TimeShifts:
        """From the residuals, with each silhouette's own noise."""
        sightings = campaign.sequences[number].task.sightings
        found = time_shifts(equations.errors, equations.frames, sightings.silhouettes, floor_px=campaign.floor_px)
        return found.take(np.argsort(sightings.times_s, kind="stable"))

    def independent(self, campaign: Campaign) -> float:
        """Tangents."""
        return INDEPENDENT_TANGENTS * sum(self.sightings(s) for s in campaign.sequences)

    def why_not(self, campaign: Campaign, effect: EffectModel) -> str | None:
        """Every effect of the catalogue applies."""
        del campaign, effect
        return None

    def adapted(self, effect: EffectModel) -> EffectModel:
        """The catalogue was written for silhouettes."""
        return effect


SILHOUETTES = Silhouettes()
