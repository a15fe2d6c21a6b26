"""The bias of a sequence's outlines from the particle's own views: predicted by its hull, then calibrated on the views.

At a fitted flight the hull casts an outline in every sighting and in every view; :mod:`estimator.geometry.outline_bias` predicts what
noise and smoothing do to each. The hull is the polytope of the views' tangent planes where the body has no hollows, and the exact visual
hull where it has: that smoothing cuts spikes is most of what biases its tangents. What the hull does not show is measured: each view in
the camera's likeness less the view as seen, ``D_k(u)``, is the difference of the two biases for the true outline. So with ``p_k`` the
prediction for view k in the camera's likeness and ``b_k`` for the view itself (per pixel of the camera, ratio s_k),
``D_k + b_k / s_k = level + slope p_k`` is fitted over all views and directions, and a sighting's bias is ``level + slope p_i``. The slope
comes out near one; hollows that no view looks into lower it.

Where outlines come from pictures, what pictures do is not described but repeated (:mod:`estimator.outlines.pictures.pictured`), for the
sightings and for the views in the camera's likeness. Not used where the views are coarser than the camera.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import flown_in, particle_poses
from estimator.appearance.model_errors import cast_outlines
from estimator.data.fit_task import FitTask
from estimator.data.views import Views
from estimator.geometry.cast_outline import cast_convex
from estimator.geometry.outline_bias import (
    DIRECTIONS,
    Calibration,
    OutlineBias,
    Rows,
    bias_curves,
    noise_streams,
    outward_directions,
    supports,
)
from estimator.geometry.support import support
from estimator.motion.flight import Flight, FlightPoses, Motion
from estimator.outlines.pictures.pictured import Pictures, pictured_supports
from estimator.particle.particle import Particle, hsv_spacing

Array = NDArray[np.float64]
LEAST_SPREAD_PX = 0.005
"""Predictions that differ by less over views and directions (a sphere's) say nothing of a slope."""

PICTURES_OF_EACH = 2
"""Pictures that are drawn of each outline (notebook 31)."""


def with_predicted_bias(
    task: FitTask, particle: Particle, motion: Motion, *, pairs: int, rng: np.random.Generator, pictures: Pictures | None = None
) -> FitTask:
    """The task with the views as they were seen and the outlines' bias predicted under ``motion``; ``pairs`` of draws per outline."""
    at = motion.first, flown_in(motion, task.sightings)
    return with_bias_at(task, particle, at, pairs=pairs, rng=rng, pictures=pictures)


def with_bias_at(
    task: FitTask,
    particle: Particle,
    motion: tuple[Flight, FlightPoses],
    *,
    pairs: int,
    rng: np.random.Generator,
    cast_there: list[Array] | None = None,
    known: OutlineBias | None = None,
    pictures: Pictures | None = None,
) -> FitTask:
    """The same at given poses, of the body of the flight beside them.

    ``cast_there``: outlines (v, 2) px that the body's casting hull has there; ``known``: this task's bias under another flight, whose part
    for the views holds under any. ``pictures``: how each sighting's picture shows outlines, where they come from pictures.
    """
    first = task.sightings.silhouettes
    spacing = hsv_spacing(particle, first)
    if pairs == 0 or spacing.min() <= 1.0:
        return task
    noise = float(np.median(first.noise_px[first.samples > 0]))
    for_views, for_sightings = noise_streams(rng)
    of_views = known or _of_views(task, particle, spacing, (noise, pictures), pairs=pairs, rng=for_views)
    there = _cast_in_sightings(task, particle, *motion) if cast_there is None else cast_there
    own = _curves(there, (noise, pictures), first.samples, pairs=pairs, rng=for_sightings)
    bias = replace(of_views, own=of_views.calibration.level + of_views.calibration.slope * own)
    return replace(task, views=Views(particle.seen, task.views.poses, task.views.centre), bias=bias)


Seeing = tuple[float, Pictures | None]
"""Noise (px) of the points of outlines, and how pictures show them where they come from pictures."""


def _curves(polygons: Sequence[Array], seeing: Seeing, samples: Rows, *, pairs: int, rng: np.random.Generator) -> Array:
    """Bias (n, 180) px of the tangents of outlines (v, 2) px."""
    noise_px, pictures = seeing
    if pictures is None:
        return bias_curves(polygons, noise_px, samples, pairs=pairs, rng=rng)
    u = outward_directions()
    sharp = np.stack([support(p, u) if len(p) else np.zeros(DIRECTIONS) for p in polygons])
    return pictured_supports(polygons, pictures, u, draws=PICTURES_OF_EACH, rng=rng) - sharp


def _of_views(task: FitTask, particle: Particle, spacing: Array, seeing: Seeing, *, pairs: int, rng: np.random.Generator) -> OutlineBias:
    """The views' bias and what it says of predictions, without any sightings."""
    cast = particle.cast_in_views
    view = particle.bias_of_views(pairs=pairs, rng=rng).curves
    coarse = np.maximum(np.round(particle.seen.samples / spacing), 1).astype(np.int64)
    typical = None if seeing[1] is None else seeing[1].typical(len(cast))
    shrunk = [p / s for p, s in zip(cast, spacing, strict=True)]
    like = _curves(shrunk, (seeing[0], typical), coarse, pairs=pairs, rng=rng)
    measured = supports(task.views.silhouettes) - supports(particle.seen) + view
    return OutlineBias(np.zeros((0, DIRECTIONS)), view, calibrated(like, measured / spacing[:, None]))


def calibrated(predicted: Array, measured: Array) -> Calibration:
    """Least squares of measured on predicted bias (k, 180), px of the camera."""
    spread = predicted - predicted.mean()
    if np.std(predicted) < LEAST_SPREAD_PX:
        return Calibration(float(np.mean(measured - predicted)), 1.0)
    slope = float(np.sum(spread * measured) / np.sum(spread**2))
    return Calibration(float(measured.mean() - slope * predicted.mean()), slope)


def _cast_in_sightings(task: FitTask, particle: Particle, flight: Flight, at: FlightPoses) -> list[Array]:
    placed = particle_poses(flight, at, task.sightings)
    if particle.has_exact_hull:
        return cast_outlines(task, placed, particle.casting_mesh)
    cameras = [task.sightings.cameras[int(c)].intrinsics for c in task.sightings.camera]
    return [cast_convex(particle.convex_vertices, camera, R, t) for camera, R, t in zip(cameras, placed.R, placed.t, strict=True)]
