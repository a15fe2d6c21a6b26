"""Silhouettes in pictures: residuals are tangency errors in pixels, with noise of the outlines, of the calibrated views and of the body."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import FrameReport
from datasets.observation import Observation
from datasets.vocabulary.effects import FURTHER_ONLY, TRACKED_ONLY, whose
from estimator.appearance.hull_outlines import hull_of
from estimator.appearance.model_errors import ModelResiduals, SequenceTask, linearised, model_residuals
from estimator.appearance.outline_tables import with_tables
from estimator.data.fit_task import Sightings
from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap
from estimator.effects.instrument.curvature_bias import CurvatureBias
from estimator.effects.link import EffectModel
from estimator.effects.model import Model, overrides
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations
from estimator.fitting.campaigns.campaign_noise import repeated_noise
from estimator.fitting.system import Arrangement
from estimator.likelihood.composite_likelihood import RandomShift, Weighted, weigh_linear
from estimator.likelihood.rows import UNKNOWN, Density
from estimator.likelihood.time_shifts import TimeShifts, likeness, noise_ratio, time_derivative, time_shifts
from estimator.measurements.silhouettes.imagined import Pictures
from estimator.measurements.silhouettes.noise_floor import silhouette_floor
from estimator.measurements.silhouettes.residual_maps import silhouette_maps
from estimator.motion.flight import Flight
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
INDEPENDENT_TANGENTS = 12.0
"""Roughly how many independent tangents an outline has, for the ratio of data to prior in the step control."""
MOST_NOISE = 1.5
"""Of eight campaigns with nothing hidden, six of them of spiky bodies, the largest has 1.33."""


@dataclass(frozen=True)
class Silhouettes:
    """The kind of :class:`estimator.appearance.model_errors.SequenceTask`; ``stated``: clocks and lenses that are so uncertain."""

    unit: str = "px"
    stated: tuple[EffectModel, ...] = ()

    @property
    def base(self) -> Model:
        """Free flight with the instrument's known discrepancy."""
        return Model((CurvatureBias(), *self.stated))

    def residuals(self, campaign: Campaign, number: int, flight: Flight, model: Model, theta: Array) -> ModelResiduals:
        """Tangency errors."""
        return model_residuals(campaign.sequences[number], flight, model, theta)

    def equations(self, campaign: Campaign, number: int, residuals: ModelResiduals, model: Model, theta: Array) -> SequenceEquations:
        """Tangency errors, weighed."""
        sequence = campaign.sequences[number]
        errors = linearised(sequence, residuals, model, theta)
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

    def cost(self, sequence: SequenceTask, residuals: ModelResiduals) -> float:
        """Huber cost on the scale of the weights: each sighting's mean error counts as often as it is independent.

        Infinite where no tangency is left, as of a body that a step put behind the camera: it would cost nothing.
        """
        seen, huber = residuals.seen, sequence.task.huber
        if not seen.any():
            return float("inf")
        variance = residuals.tangency.variance[:, :, :2]
        z = np.abs(residuals.e) / np.sqrt(variance)
        rho = np.where(z <= huber, 0.5 * z**2, huber * z - 0.5 * huber**2)
        return float((rho * seen).sum() / max(seen.sum(axis=(1, 2)).mean(), 1.0) * INDEPENDENT_TANGENTS)

    def repeated_noise(
        self, campaign: Campaign, errors: Sequence[Any], frames: Sequence[Weighted], at: Arrangement, like: Sequence[Any] | None = None
    ) -> Array:
        """That of the calibrated views and of the body."""
        return repeated_noise(campaign, errors, frames, at, like)

    def sightings(self, sequence: SequenceTask) -> int:
        """Outlines in use."""
        return len(sequence.task.sightings)

    def only(self, sequence: SequenceTask, kept: NDArray[np.bool_]) -> SequenceTask:
        """Pairs of the other sightings get no weight."""
        weight = np.where(kept[:, None], sequence.task.weight, 0.0)
        return replace(sequence, task=replace(sequence.task, weight=weight))

    def followed(self, sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> SequenceTask:
        """Shape and bias of the outlines."""
        return with_tables(sequence, flight, model, theta)

    def relinearised(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """Nothing is shared but parameters."""
        return campaign, fit.state

    def ended(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """Outlines show their noise by themselves."""
        return campaign, fit.state

    def noise_scales(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> Array | None:
        """Noise is read off every outline; what it is off by, scores of all candidates show."""
        del campaign, equations
        return None

    def noise_of(self, sequence: SequenceTask) -> float:
        """What the outlines say."""
        del sequence
        return 1.0

    def misses(self, sequence: SequenceTask, mean_square: float) -> float:
        """Outlines show their noise."""
        del sequence
        return float(np.sqrt(mean_square))

    def with_noise(self, sequence: SequenceTask, noise: float) -> SequenceTask:
        """Nothing to scale."""
        del noise
        return sequence

    def density(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> Density:
        """Tangents of one outline are nearly functions of one another: their density is not known, that of scores is."""
        del campaign, equations
        return UNKNOWN

    def squares(self, equations: Sequence[SequenceEquations]) -> float:
        """Of all errors, tangents that are alike as often as there are."""
        return sum(float(np.sum(each.frames.weight * each.errors.e**2)) for each in equations)

    def hollow(self, sequence: SequenceTask) -> float:
        """Of the outlines that the hull casts."""
        return sequence.hollow

    def time_shifts(self, campaign: Campaign, number: int, equations: SequenceEquations) -> tuple[TimeShifts, ...]:
        """From the residuals, with each silhouette's own noise."""
        sightings = campaign.sequences[number].task.sightings
        found = time_shifts(equations.errors, equations.frames, sightings.silhouettes, floor_px=campaign.floor_px)
        return tuple(found.take(rows) for rows in sightings.in_time)

    def noise_ratio(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> float:
        """From second differences of movements, and from how alike they are.

        What moves pictures from frame to frame enters the former, so it is cut at ``MOST_NOISE``.
        """
        shifts = campaign.time_shifts(equations)
        return min(noise_ratio(shifts), MOST_NOISE) * likeness(shifts)

    def why_not(self, campaign: Campaign, effect: EffectModel) -> str | None:
        """All effects apply but those on a gyroscope, those of other cameras, and those that such short flights do not show."""
        key, camera = whose(effect.entry.key)
        if camera and camera not in campaign.cameras:
            return f"there is no camera {camera}, but {' and '.join(campaign.cameras)}"
        if key in FURTHER_ONLY and (camera in campaign.cameras[:1] or not _films_beside_another(campaign, camera)):
            return "it is of a further camera against the first one"
        if overrides(effect, "reading"):
            return "it acts on a gyroscope's readings"
        if overrides(effect, "tracked"):
            return "it acts on what a tracker reports"
        return "a flight of centimetres does not show it" if effect.entry.key in TRACKED_ONLY else None

    def noise_floor(self, campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
        """Against outlines' noise that changes with every frame."""
        return silhouette_floor(campaign, fit, rng)

    def residual_maps(self, campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
        """Of outline-normal residuals."""
        return silhouette_maps(campaign, fit)

    def imagination(self, campaign: Campaign, number: int, fit: CampaignFit, particles: Sequence[Particle]) -> Pictures:
        """Pictures of the particle's hull."""
        corners = hull_of(particles[campaign.particle[number]])
        return Pictures(campaign.sequences[number], fit.state.flights[number], corners, fit.model, fit.state.theta[number])

    def statistics(self, equations: SequenceEquations) -> dict[str, Any]:
        """Pairs and their errors."""
        seen = equations.errors.tangency.valid
        return {
            "n_pairs": int(seen.sum()),
            "pairs_without_tangents": int((~seen).sum()),
            "rms_ete_px": float(np.sqrt(np.mean(equations.errors.e[seen] ** 2))),
        }

    def frame_reports(self, sequence: SequenceTask, observation: Observation, equations: SequenceEquations) -> tuple[FrameReport, ...]:
        """Every picture of every camera."""
        sightings, seen = sequence.task.sightings, equations.errors.seen
        rms = np.sqrt((equations.errors.e**2).sum(axis=(1, 2)) / np.maximum(seen.sum(axis=(1, 2)), 1))
        whitened = np.sqrt(equations.frames.chi2 / np.maximum(equations.frames.count, 1))
        return picture_reports(sightings, observation, rms, whitened)

    def unmeasured(self, sequence: SequenceTask) -> NDArray[np.int64]:
        """None."""
        del sequence
        return np.zeros(0, dtype=np.int64)

    def adapted(self, effect: EffectModel) -> EffectModel:
        """The catalogue was written for silhouettes."""
        return effect


SILHOUETTES = Silhouettes()


def _films_beside_another(campaign: Campaign, camera: str) -> bool:
    """Whether a camera is a further one in some recording."""
    return any(camera in (each.name for each in sequence.task.sightings.cameras[1:]) for sequence in campaign.sequences)


def picture_reports(sightings: Sightings, observation: Observation, rms_px: Array, whitened: Array) -> tuple[FrameReport, ...]:
    """Every picture of every camera, those in use with tangency errors ``rms_px`` (n,) and residuals ``whitened`` (n,)."""
    used = {(int(c), int(f)): i for i, (c, f) in enumerate(zip(sightings.camera, sightings.frame, strict=True))}
    reports = []
    for camera, recording in enumerate(observation.recordings):
        for frame in range(len(recording)):
            row = used.get((camera, frame))
            if row is None:
                reports.append(FrameReport(camera, frame, False, "no usable outline", 0.0, 0.0))
            else:
                reports.append(FrameReport(camera, frame, True, "", float(rms_px[row]), float(whitened[row])))
    return tuple(reports)
