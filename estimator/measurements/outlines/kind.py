"""Outlines sample by sample: residuals of sectors, with noise that is new in each, and the surface's amplitudes in the base model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import FrameReport
from datasets.observation import Observation
from estimator.appearance.hull_outlines import hull_of
from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap
from estimator.effects.instrument.surface_amplitudes import SurfaceAmplitudes
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, fit_campaign
from estimator.likelihood.rows import robust_cost, shifts_in_time, weighed
from estimator.likelihood.time_shifts import TimeShifts
from estimator.measurements.outlines.frame_noise import with_frame_noise
from estimator.measurements.outlines.imagined import SampledPictures
from estimator.measurements.outlines.maps import outline_maps
from estimator.measurements.outlines.surface_scale import with_surface_scale
from estimator.measurements.outlines.surfaces import refitted_surfaces
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask, linearised, outline_residuals, rate_of, with_contacts
from estimator.measurements.own_noise import OwnNoise
from estimator.measurements.silhouettes.imagined import Pictures
from estimator.measurements.silhouettes.kind import SILHOUETTES, picture_reports
from estimator.measurements.silhouettes.noise_floor import floor_between_frames
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
OFF = "its outline is off as a whole from where those beside it are"
"""Why a picture is not used."""


@dataclass(frozen=True)
class Outlines(OwnNoise):
    """The kind of :class:`estimator.measurements.outlines.task.OutlineTask`.

    ``amplitudes``: how many a particle's surface has, which answers to all ``effects``. ``huber``: standard deviations beyond which a
    sample's influence stays constant where surfaces are fitted; ``seed`` of random signs there; ``stated``: clocks and lenses that are
    stated to be uncertain.
    """

    amplitudes: int
    effects: tuple[EffectModel, ...]
    huber: float
    seed: int
    stated: tuple[EffectModel, ...] = ()

    @property
    def base(self) -> Model:
        """Free flight of a body whose surface is known up to its amplitudes."""
        return Model((SurfaceAmplitudes(self.amplitudes), *self.stated))

    def residuals(self, campaign: Campaign, number: int, flight: Flight, model: Model, theta: Array) -> OutlineResiduals:
        """What the surface misses the samples by."""
        return outline_residuals(campaign.sequences[number], flight, model, theta)

    def equations(self, campaign: Campaign, number: int, residuals: OutlineResiduals, model: Model, theta: Array) -> SequenceEquations:
        """Residuals with their derivatives, weighed."""
        errors = linearised(residuals, model, theta)
        return SequenceEquations(errors, weighed(errors, campaign.sequences[number].repeats))

    def precision(self, sequence: OutlineTask) -> Array:
        """What a uniformly filled surface says of the body, and what is believed of outlines."""
        precision = np.zeros(N_PARAMETERS)
        precision[COM], precision[INERTIA] = sequence.deviation[:3] ** -2.0, sequence.deviation[3:] ** -2.0
        precision[OFFSET] = sequence.task.prior.precision[OFFSET]
        return precision

    def cost(self, sequence: OutlineTask, residuals: OutlineResiduals) -> float:
        """Huber cost; noise does not depend on the fit. Infinite where nothing is seen, as of a body behind the camera."""
        rate = rate_of(residuals) if residuals.jitter_s else None
        return robust_cost(residuals, sequence.repeats, rate) if residuals.seen.any() else float("inf")

    def sightings(self, sequence: OutlineTask) -> int:
        """Outlines in use."""
        return len(sequence.task.sightings)

    def followed(self, sequence: OutlineTask, flight: Flight, model: Model, theta: Array) -> OutlineTask:
        """What the samples meet there."""
        return with_contacts(sequence, flight, model, theta)

    def relinearised(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """About the surfaces that views and frames show together, as uncertain as the frames show them to be."""
        keys = tuple(key for key in fit.model.keys if key not in self.base.keys)
        if any(sequence.under != keys for sequence in campaign.sequences):
            campaign, state = refitted_surfaces(campaign, fit, self)
            fit = fit_campaign(campaign, state, fit.model)
            at = [(flight, fit.model, theta) for flight, theta in zip(fit.state.flights, fit.state.theta, strict=True)]
            campaign = replace(campaign, sequences=tuple(with_frame_noise(campaign.sequences, at)))
            fit = fit_campaign(campaign, fit.state, fit.model)
        return with_surface_scale(campaign, fit)

    def misses(self, sequence: OutlineTask, mean_square: float) -> float:
        """Outlines show their noise by themselves; what a fit takes for noise may be more."""
        return sequence.noise * float(np.sqrt(mean_square))

    def with_noise(self, sequence: OutlineTask, noise: float) -> OutlineTask:
        """With larger standard deviations."""
        return replace(sequence, noise=noise)

    def hollow(self, sequence: OutlineTask) -> float:
        """Hollows are in the surface."""
        return sequence.hollow

    def time_shifts(self, campaign: Campaign, number: int, equations: SequenceEquations) -> tuple[TimeShifts, ...]:
        """From the residuals along the motion."""
        found = shifts_in_time(equations)
        return tuple(found.take(rows) for rows in campaign.sequences[number].task.sightings.in_time)

    def why_not(self, campaign: Campaign, effect: EffectModel) -> str | None:
        """As for tangency errors."""
        return SILHOUETTES.why_not(campaign, effect)

    def noise_floor(self, campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
        """Residuals in standard deviations of the noise, by how those of a sector change from frame to frame."""
        return floor_between_frames(campaign, fit, rng, alike=campaign.sequences[0].alike)

    def residual_maps(self, campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
        """Of outline-normal residuals."""
        return outline_maps(campaign, fit)

    def imagination(self, campaign: Campaign, number: int, fit: CampaignFit, particles: Sequence[Particle]) -> SampledPictures:
        """Samples of the outlines that the surface casts."""
        sequence, corners = campaign.sequences[number], hull_of(particles[campaign.particle[number]])
        return SampledPictures(Pictures(sequence, fit.state.flights[number], corners, fit.model, fit.state.theta[number]), sequence)

    def statistics(self, equations: SequenceEquations) -> dict[str, Any]:
        """Residuals and their noise in pixels of single samples."""
        errors = equations.errors
        seen, sigma = errors.seen, np.sqrt(errors.variance)
        return {
            "sectors": int(seen.sum()),
            "rms_px": float(np.sqrt(np.mean((errors.e * sigma)[seen] ** 2))),
            "noise_px": float(np.sqrt(np.mean(errors.variance[seen]))),
        }

    def frame_reports(self, sequence: OutlineTask, observation: Observation, equations: SequenceEquations) -> tuple[FrameReport, ...]:
        """Every picture of every camera; they have no tangency errors."""
        sightings = sequence.task.sightings
        whitened = np.sqrt(equations.frames.chi2 / np.maximum(equations.frames.count, 1))
        off = {(int(c), int(f)) for c, f in zip(sightings.camera[~sequence.kept], sightings.frame[~sequence.kept], strict=True)}
        reports = picture_reports(sightings, observation, np.full(len(sightings), np.nan), whitened)
        return tuple(replace(each, used=False, reason=OFF) if (each.camera, each.frame) in off else each for each in reports)

    def unmeasured(self, sequence: OutlineTask) -> NDArray[np.int64]:
        """None."""
        del sequence
        return np.zeros(0, dtype=np.int64)

    def adapted(self, effect: EffectModel) -> EffectModel:
        """The catalogue was written for silhouettes."""
        return effect
