"""Sequences that have not been recorded: the samples of the outlines that the surface would cast, as dense and noisy as recorded ones are.

Only what decides how well parameters could be seen is imagined: which points of the surface samples meet, and how noisy they are. Which
frames lie in the picture the hull says, as for tangency errors (:mod:`estimator.measurements.silhouettes.imagined`). Samples lie
where the fit, its effects included, has them: residuals are zero.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from estimator.appearance.model_errors import SequenceTask, cast_outlines, centres_cam
from estimator.diagnosis.imagined_sequences import Drop, Imagined
from estimator.fitting.campaigns.campaign import SequenceEquations
from estimator.geometry.closed_curves import resampled
from estimator.measurements.outlines.contacts import SECTORS, contacts_at
from estimator.measurements.outlines.task import OutlineTask, amplitudes_in, outline_residuals, placed_at, with_sectors
from estimator.measurements.silhouettes.imagined import Pictures, rows_of, thinned
from estimator.motion.flight import Flight
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class _Unsampled(SequenceTask):
    """Silhouettes of an imagined ``flight``; samples are only made for those that count."""

    flight: Flight = field(kw_only=True)


@dataclass(frozen=True)
class SampledPictures:
    """Outlines as a recorded sequence has them; ``pictures``: their silhouettes, the ``sequence`` of which is an outline task."""

    pictures: Pictures
    sequence: OutlineTask

    @property
    def theta(self) -> Array:
        """Parameters (q,) of the fit's effects."""
        return self.pictures.theta

    @property
    def camera(self) -> Intrinsics:
        """The first camera's lens."""
        return self.pictures.camera

    @property
    def recorded(self) -> Drop:
        """As its silhouettes have it."""
        return self.pictures.recorded

    def imagined(self, drop: Drop) -> Imagined:
        """The drop where it is, or aimed at the middle of the picture where that shows more of it."""
        made = self.pictures.imagined(drop)
        return replace(made, sequence=_Unsampled(**_fields(made.sequence), flight=made.drop.flight))

    def thinned(self, sequence: OutlineTask | _Unsampled, most: int) -> tuple[OutlineTask, float]:
        """The sequence with at most ``most`` of its sightings and their samples, and how many each of those stands for."""
        if isinstance(sequence, _Unsampled):
            silhouettes, times = thinned(sequence, most)
            return self._sampled(silhouettes), times
        n = len(sequence.task.sightings)
        rows = rows_of(n, most)
        return sequence.take(rows), n / len(rows)

    def silent(self, equations: SequenceEquations) -> SequenceEquations:
        """The equations themselves: their noise is stated, and residuals are zero."""
        return equations

    def more_views(self, sequence: OutlineTask, particle: Particle) -> OutlineTask:
        """Twice as many views halve the variance of what is known of the surface: at most, since the prior knows part of it."""
        del particle
        less, here = np.sqrt(0.5), sequence.contacts.amplitude
        mass = sequence.amplitudes.mass
        known = np.column_stack([mass[:, 0] + (1.0 - less) * mass[:, 1:] @ here, less * mass[:, 1:]])
        amplitudes = replace(sequence.amplitudes, moves=less * sequence.amplitudes.moves, mass=known)
        contacts = replace(sequence.contacts, by_amplitude=less * sequence.contacts.by_amplitude)
        return replace(sequence, amplitudes=amplitudes, contacts=contacts, setting=replace(sequence.setting, mass=known))

    @cached_property
    def _spacing_px(self) -> float:
        """Distance of neighbouring samples, in the median."""
        steps = (np.linalg.norm(np.diff(outline, axis=0), axis=1) for outline in self.sequence.task.sightings.outlines_px)
        return float(np.median(np.concatenate(list(steps))))

    def _sampled(self, few: _Unsampled) -> OutlineTask:
        """Silhouettes with their samples."""
        like, flight, model, theta = self.sequence, few.flight, self.pictures.model, self.theta
        amplitude = theta[amplitudes_in(model)]
        sightings = few.task.sightings
        prediction, placed = placed_at(few, flight, model, theta)
        surface = like.amplitudes.surface_at(amplitude)
        outlines = cast_outlines(few.task, placed, replace(surface.sphere.mesh, vertices=surface.vertices))
        seen = replace(sightings, outlines_px=tuple(resampled(each, self._spacing_px, fewest=SECTORS) for each in outlines))
        contacts = contacts_at(like.amplitudes, amplitude, seen, placed, np.concatenate(seen.outlines_px))
        known = {**_fields(few), "task": replace(few.task, sightings=seen), "made_at": None}
        n = len(seen)
        made = replace(like, **known, contacts=contacts, own_px=np.full(n, np.median(like.own_px)), kept=np.ones(n, dtype=np.bool_))
        return self._where_the_fit_has_them(with_sectors(made, prediction, centres_cam(flight, placed)), flight)

    def _where_the_fit_has_them(self, made: OutlineTask, flight: Flight) -> OutlineTask:
        """With every sector's samples moved along their normals by what the fit misses them by: effects displace outlines."""
        errors = outline_residuals(made, flight, self.pictures.model, self.theta)
        away = (errors.e * np.sqrt(errors.variance)).ravel()[made.contacts.cell, None] * made.contacts.normal
        sightings = made.task.sightings
        samples = np.concatenate(sightings.outlines_px) - away
        ends = np.cumsum([len(each) for each in sightings.outlines_px])[:-1]
        moved = replace(sightings, outlines_px=tuple(np.split(samples, ends)))
        return replace(made, task=replace(made.task, sightings=moved))


def _fields(sequence: SequenceTask) -> dict[str, Any]:
    return {name: getattr(sequence, name) for name in SequenceTask.__dataclass_fields__}
