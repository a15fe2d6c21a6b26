"""Sequences that have not been recorded: the silhouettes that the hull would cast, with the noise that a recorded sequence has.

Only what decides how well parameters could be seen is imagined: where tangencies lie and how noisy they are. The outlines are those of the
convex hull of the visual hull, without noise; the fit's effects place the body, but do not bend its picture. Frames in which the particle
is not wholly in the picture are left out.
"""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from estimator.appearance.hull_outlines import hull_of, like_noise, outline_of
from estimator.appearance.model_errors import SequenceTask
from estimator.data.fit_task import FitTask, Sightings, restricted
from estimator.diagnosis.imagined_sequences import Drop, Imagined, about, at_pixel
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import SequenceEquations
from estimator.fitting.campaigns.forced_velocities import body_under, forced_states
from estimator.geometry.outline_shape import outline_shape
from estimator.measurements.silhouettes.imagined_views import with_more_views
from estimator.motion.flight import Flight, still
from estimator.motion.rigid_body import rotation_matrices
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
Thinned = TypeVar("Thinned", bound=SequenceTask)
NEVER_OUTLYING = 1e6
"""Imagined errors have no outliers."""


@dataclass(frozen=True)
class Pictures:
    """Silhouettes as a recorded sequence has them.

    ``sequence`` and its ``flight``; ``corners`` (v, 3) m of its particle's convex hull, nominal body axes about the centre of mass;
    ``model`` and ``theta`` (q,) of the fit.
    """

    sequence: SequenceTask
    flight: Flight
    corners: Array
    model: Model
    theta: Array

    @property
    def camera(self) -> Intrinsics:
        """The first camera's lens."""
        return self.sequence.task.sightings.cameras[0].intrinsics

    @property
    def recorded(self) -> Drop:
        """The recorded drop, or the one flight of it, its time stamps laid about the flight's reference time."""
        nominal, sightings = self.sequence.setting, self.sequence.task.sightings
        frames = len(np.unique(sightings.frame)) if self.sequence.number else len(nominal.times_s)
        return Drop(self.flight, about(self.flight.time_s, frames, nominal.interval_s), sightings.cameras)

    def imagined(self, drop: Drop) -> Imagined:
        """The drop where it is, or aimed at the middle of the picture where that shows more of it."""
        sequence = silhouettes_of(drop, self)
        if len(sequence.task.sightings) < len(drop.times_s) * len(drop.cameras):
            aimed = at_pixel(drop)
            other = silhouettes_of(aimed, self)
            if len(other.task.sightings) > len(sequence.task.sightings):
                drop, sequence = aimed, other
        return Imagined(drop, sequence, len(np.unique(sequence.task.sightings.frame)))

    def thinned(self, sequence: SequenceTask, most: int) -> tuple[SequenceTask, float]:
        """As in :func:`thinned`."""
        return thinned(sequence, most)

    def silent(self, equations: SequenceEquations) -> SequenceEquations:
        """Errors of infinite variance; their weights are made already."""
        tangency = equations.errors.tangency
        unknown = replace(tangency, variance=np.full_like(tangency.variance, np.inf))
        return replace(equations, errors=replace(equations.errors, tangency=unknown))

    def more_views(self, sequence: SequenceTask, particle: Particle) -> SequenceTask:
        """The particle laid down anew before the cameras of its views."""
        return with_more_views(sequence, particle, hull_of(particle))


def silhouettes_of(drop: Drop, like: Pictures) -> SequenceTask:
    """The sequence that ``drop`` would give; its sightings are those that lie wholly in the picture."""
    known = like.sequence.setting
    clocks = {name: replace(clock, times_s=drop.times_s) for name, clock in known.clocks.items()}
    setting = replace(known, times_s=drop.times_s, clocks=clocks, edge_px=float(np.median(known.edge_px)))
    R_world_body, centres = _poses(drop, like, setting)
    polygons: list[Array] = []
    camera: list[int] = []
    frame: list[int] = []
    for number, hsv in enumerate(drop.cameras):
        for i, (R, centre) in enumerate(zip(R_world_body, centres, strict=True)):
            placed = (hsv.R_cam_world @ centre + hsv.t_cam_world) / like.model.scale(like.theta)
            polygon = _in_picture(like.corners @ (hsv.R_cam_world @ R).T + placed, hsv.intrinsics)
            if polygon is not None:
                polygons.append(polygon)
                camera.append(number)
                frame.append(i)
    frames = np.array(frame, dtype=np.int64)
    seen = like_noise(polygons, [drop.cameras[c].intrinsics for c in camera], like.sequence.task.sightings.silhouettes)
    sightings = Sightings(seen, np.array(camera, dtype=np.int64), frames, drop.times_s[frames], drop.cameras)
    task = like.sequence.task
    weight = np.tile(task.weight.max(axis=0), (len(frames), 1))
    new = FitTask(sightings, task.views, task.prior, NEVER_OUTLYING, weight)
    return SequenceTask("imagined", new, setting, like.sequence.rim, outline_shape(polygons))


def _poses(drop: Drop, like: Pictures, setting: Setting) -> tuple[Array, Array]:
    """World from nominal body axes (f, 3, 3) and where the nominal centre of mass is (f, 3) m."""
    at = (like.model, like.theta, setting)
    reached, _ = forced_states(drop.flight, still(drop.flight), at, drop.times_s)
    R = rotation_matrices(reached.q[:, 0])
    return R, reached.x[:, 0] - R @ body_under(drop.flight, *at).com


def _in_picture(points_cam: Array, lens: Intrinsics) -> Array | None:
    """Convex outline (px) of points in front of the camera, ``None`` where it is not wholly in the picture."""
    if points_cam[:, 2].min() <= 0.0:
        return None
    outline = outline_of(points_cam, lens)
    most = np.array([lens.width_px, lens.height_px]) - 1.0
    return None if (outline < 0.0).any() or (outline > most).any() else outline


GOLDEN = 0.6180339887498949
"""Golden ratio less one: its multiples fall evenly within a step."""


def thinned(sequence: Thinned, most: int) -> tuple[Thinned, float]:
    """The sequence with at most ``most`` of its sightings, and how many each of those stands for."""
    n = len(sequence.task.sightings)
    rows = rows_of(n, most)
    if len(rows) == n:
        return sequence, 1.0
    task, setting = restricted(sequence.task, rows), sequence.setting.take(rows)
    return replace(sequence, task=task, setting=setting, shape=sequence.shape.take(rows)), n / len(rows)


def rows_of(n: int, most: int) -> NDArray[np.int64]:
    """Numbers of at most ``most`` of n sightings that stand for all, in ascending order; all where there are no more.

    One of each stretch of time, at a place that changes from stretch to stretch: evenly spaced ones would be blind to some vibrations.
    Where stretches are shorter than two sightings, one may be that of two of them: it is there once.
    """
    if n <= most:
        return np.arange(n)
    return np.unique(np.floor((np.arange(most) + (np.arange(most) * GOLDEN) % 1.0) * n / most).astype(np.int64))
