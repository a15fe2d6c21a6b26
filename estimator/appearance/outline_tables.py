"""What is made of a sequence's outlines once a flight is known: the shape of those that the body casts there, and their predicted bias.

Both follow the flight: where an effect that was missing turns the body by degrees, tables made without it belong to other outlines, and
what they are wrong by looks like a smaller effect. They are made anew once a fit has turned the body by more than ``MOST_TURNED_DEG``.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses
from estimator.appearance.model_errors import SequenceTask, cast_outlines, centres_cam, moving_at
from estimator.appearance.predicted_bias import with_bias_at
from estimator.appearance.prediction import Prediction, predict
from estimator.data.views import Views
from estimator.effects.link import Moving
from estimator.effects.model import Model
from estimator.geometry.cast_outline import CastingMesh, with_hollows_seen
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.hollows import hollow_share
from estimator.geometry.outline_shape import OutlineShape, Sampling, as_of_a_hull, outline_shape
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import Flight
from estimator.outlines.pictures.pictured import Pictures
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
MOST_TURNED_DEG = 0.4
"""Root mean square over the sightings; free flights fitted one by one and together differ by some 0.3 degrees (notebook 23)."""
RIM_POINTS = 72
"""Directions about an outline, every five degrees, through which its affine motion is fitted. By judgement."""


@dataclass(frozen=True, eq=False)
class OutlineTables:
    """Makes the tables of sequences of one particle.

    ``likeness``: the calibrated views as the camera would have seen them; ``pairs`` of draws for the bias of every outline, 0 where it is
    not predicted; ``seed`` of those draws. ``pictures``: how each sighting's picture shows outlines, where they come from pictures.
    """

    particle: Particle
    likeness: Views
    pairs: int
    seed: int
    pictures: Pictures | None = None

    def followed(self, sequence: SequenceTask, flight: Flight, prediction: Prediction) -> SequenceTask:
        """The sequence with its tables made at ``prediction``; as it is where those are of nearly the same poses."""
        placed = particle_poses(flight, prediction.poses, sequence.task.sightings)
        if turned_deg(sequence.made_at, placed.R) < MOST_TURNED_DEG:
            return sequence
        outlines, shape = shape_at(sequence, flight, prediction, self.particle.casting_mesh)
        task = replace(sequence.task, views=self.likeness, bias=None)
        rng = np.random.default_rng(self.seed)
        there = outlines if self.particle.has_exact_hull else None
        motion = (flight, prediction.poses)
        task = with_bias_at(
            task,
            self.particle,
            motion,
            pairs=self.pairs,
            rng=rng,
            cast_there=there,
            known=sequence.task.bias,
            pictures=self.pictures,
        )
        shape = as_of_a_hull(shape, outlines)
        return replace(sequence, task=task, shape=shape, made_at=placed.R, hollow=hollow_share(outlines))


def shape_at(sequence: SequenceTask, flight: Flight, prediction: Prediction, mesh: CastingMesh) -> tuple[list[Array], OutlineShape]:
    """The outlines (v, 2) px that a body's ``mesh``, particle frame, casts at ``prediction``, and their shape, in motion as there.

    Hollows that the sightings show and the mesh lacks count in the shape, but for light that leaks: that asks for smooth outlines.
    """
    sightings = sequence.task.sightings
    placed = particle_poses(flight, prediction.poses, sightings)
    outlines = cast_outlines(sequence.task, placed, mesh)
    motions = picture_motions(sequence, moving_at(sequence, prediction, centres_cam(flight, placed)))
    sampling = sampling_of(sightings.silhouettes)
    if not sightings.outlines_px:
        return outlines, outline_shape(outlines, motions, sampling=sampling)
    hollow = [with_hollows_seen(cast, seen) for cast, seen in zip(outlines, sightings.outlines_px, strict=True)]
    return outlines, outline_shape(hollow, motions, flat=outlines, sampling=sampling)


def sampling_of(seen: Silhouettes) -> Sampling:
    """How outlines were seen, all with the same noise."""
    told = seen.samples > 0
    return Sampling(float(np.median(seen.noise_px[told])) if told.any() else 0.0, seen.samples)


def with_tables(sequence: SequenceTask, flight: Flight, model: Model, theta: Array) -> SequenceTask:
    """The sequence with the tables of a flight and effect parameters ``theta`` (q,); as it is where nothing is known to make them from."""
    if sequence.tables is None:
        return sequence
    sightings = sequence.task.sightings
    prediction = predict(flight, model, theta, sequence.setting, sightings.times_s, rows_px=sightings.rows_px, seen=sightings.seen)
    return sequence.tables.followed(sequence, flight, prediction)


def turned_deg(before: Array | None, R: Array) -> float:
    """Root mean square angle between rotations; infinite where there were none before.

    ``before`` (n, 3, 3) from the particle's to the camera's frame, as ``R`` (n, 3, 3) in the camera's frame now.
    """
    if before is None:
        return float("inf")
    cosine = 0.5 * (np.einsum("nij,nij->n", before, R) - 1.0)
    return float(np.degrees(np.sqrt(np.mean(np.arccos(np.clip(cosine, -1.0, 1.0)) ** 2))))


def picture_motions(sequence: SequenceTask, moving: Moving) -> Array:
    """Affine maps (n, 3, 2) from a picture's ``x, y, 1`` (px) to its displacement (px) during the exposure, fitted to the body's rim."""
    sightings = sequence.task.sightings
    arms = moving.arms_towards(unit_circle(RIM_POINTS))
    displacement = moving.velocity_px(arms, sightings.silhouettes.focal_px) * sequence.setting.exposures_s(sightings.seen)[:, None, None]
    motions = np.zeros((len(sightings), 3, 2))
    for i, points in enumerate(moving.centre_cam[:, None] + arms):
        pixels = sightings.cameras[int(sightings.camera[i])].intrinsics.project(points)
        motions[i] = np.linalg.lstsq(np.column_stack([pixels, np.ones(RIM_POINTS)]), displacement[i], rcond=None)[0]
    return motions
