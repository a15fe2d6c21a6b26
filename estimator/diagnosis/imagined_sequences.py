"""Sequences that have not been recorded: the silhouettes that the hull would cast, with the noise that a recorded sequence has.

Only what decides how well parameters could be seen is imagined: where tangencies lie and how noisy they are. The outlines are those of the
convex hull of the visual hull, without noise; the fit's effects place the body, but do not bend its picture. Frames in which the particle
is not wholly in the picture are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.fitting.campaign import SequenceEquations
from estimator.fitting.forced_velocities import body_under, forced_states
from estimator.fitting.model_errors import SequenceTask
from estimator.fitting.trajectory import FitTask, Sightings, restricted
from estimator.geometry.outline_shape import outline_shape
from estimator.geometry.silhouettes import Silhouettes, pack
from estimator.geometry.tangent_hull import TangentHull
from estimator.motion.flight import N_PARAMETERS, Flight
from estimator.motion.rigid_body import rotation_matrices
from estimator.particle import Particle

Array = NDArray[np.float64]
NEVER_OUTLYING = 1e6
"""Imagined errors have no outliers."""


@dataclass(frozen=True)
class Drop:
    """What would be recorded: a flight at the time stamps ``times_s`` (f,) by ``cameras`` (none for a trajectory).

    ``known_start``: the flight's own ``v`` is that at the first frame and known beforehand.
    """

    flight: Flight
    times_s: Array
    cameras: tuple[HsvCamera, ...]
    known_start: bool = False


def lasting(drop: Drop, ratio: float) -> Drop:
    """The drop with ``ratio`` times as many frames."""
    interval = float(np.median(np.diff(drop.times_s)))
    return replace(drop, times_s=about(drop.flight.time_s, round(ratio * len(drop.times_s)), interval))


def about(time_s: float, frames: int, interval_s: float) -> Array:
    """Time stamps (f,) with ``time_s`` in their middle."""
    return np.asarray(time_s + interval_s * (np.arange(frames) - (frames - 1) // 2))


def in_the_middle(drop: Drop) -> Drop:
    """The drop with its reference state on the ray through the middle of the first camera's picture, as deep as before."""
    return at_pixel(drop, (0.5, 0.5))


def at_pixel(drop: Drop, place: tuple[float, float]) -> Drop:
    """The drop with its reference state at ``place``, in shares of the first picture's width and height, as deep as before.

    Without a camera it stays where it is.
    """
    if not drop.cameras:
        return drop
    camera = drop.cameras[0]
    lens = camera.intrinsics
    pixel = np.array([[place[0] * (lens.width_px - 1), place[1] * (lens.height_px - 1)]])
    depth = float((camera.R_cam_world @ drop.flight.x + camera.t_cam_world)[2])
    x_cam = depth * np.append(lens.normalise(pixel)[0], 1.0)
    return replace(drop, flight=replace(drop.flight, x=camera.R_cam_world.T @ (x_cam - camera.t_cam_world)))


class Imagination(Protocol):
    """How sequences of one kind are imagined, in the likeness of a recorded one."""

    @property
    def theta(self) -> Array:
        """Parameters (q,) of the fit's effects in a new sequence."""
        ...

    @property
    def camera(self) -> Intrinsics | None:
        """The first camera's lens, where there is one."""
        ...

    @property
    def recorded(self) -> Drop:
        """The recorded drop itself."""
        ...

    def imagined(self, drop: Drop) -> "Imagined":
        """What a drop would give."""
        ...

    def thinned(self, sequence: Any, most: int) -> tuple[Any, float]:
        """A sequence with fewer sightings, and how many each of those stands for."""
        ...

    def silent(self, equations: SequenceEquations) -> SequenceEquations:
        """Equations of an imagined sequence, whose errors shall not count where noise is measured."""
        ...


@dataclass(frozen=True)
class Imagined:
    """A sequence that was not recorded, the drop behind it (perhaps aimed anew), and in how many frames something is seen."""

    drop: Drop
    sequence: Any
    frames: int


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
        """The recorded drop, its time stamps laid about the flight's reference time."""
        nominal = self.sequence.setting
        return Drop(self.flight, about(self.flight.time_s, len(nominal.times_s), nominal.interval_s), self.sequence.task.sightings.cameras)

    def imagined(self, drop: Drop) -> Imagined:
        """The drop where it is, or aimed at the middle of the picture where that shows more of it."""
        sequence = silhouettes_of(drop, self)
        if len(sequence.task.sightings) < len(drop.times_s) * len(drop.cameras):
            aimed = in_the_middle(drop)
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


def hull_of(particle: Particle) -> Array:
    """Corners (c, 3) m of the convex hull of a particle's visual hull, nominal body axes about the centre of mass."""
    vertices = (particle.hull.vertices - particle.body.com_particle) @ particle.body.R_particle_body
    return np.asarray(vertices[ConvexHull(vertices).vertices])


def silhouettes_of(drop: Drop, like: Pictures) -> SequenceTask:
    """The sequence that ``drop`` would give; its sightings are those that lie wholly in the picture."""
    known = like.sequence.setting
    setting = replace(known, times_s=drop.times_s, edge_px=float(np.median(known.edge_px)))
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
    reached, _ = forced_states(drop.flight, np.zeros((1, N_PARAMETERS)), at, drop.times_s)
    R = rotation_matrices(reached.q[:, 0])
    return R, reached.x[:, 0] - R @ body_under(drop.flight, *at).com


def _in_picture(points_cam: Array, lens: Intrinsics) -> Array | None:
    """Convex outline (px) of points in front of the camera, ``None`` where it is not wholly in the picture."""
    if points_cam[:, 2].min() <= 0.0:
        return None
    outline = outline_of(points_cam, lens)
    most = np.array([lens.width_px, lens.height_px]) - 1.0
    return None if (outline < 0.0).any() or (outline > most).any() else outline


def outline_of(points_cam: Array, lens: Intrinsics) -> Array:
    """Convex outline (v, 2) px of points (n, 3) m, camera coordinates."""
    pixels = lens.project(points_cam)
    return np.asarray(pixels[ConvexHull(pixels).vertices])


def like_noise(polygons: Sequence[Array], lenses: Sequence[Intrinsics], noisy: Silhouettes) -> Silhouettes:
    """Silhouettes of outlines whose tangents are as noisy as those of ``noisy`` are in the median."""
    sigma, turn = float(np.median(noisy.sigma_px)), float(np.median(noisy.correlation_rad))
    noise, samples = float(np.median(noisy.noise_px)), int(np.median(noisy.samples))
    hulls = [TangentHull(p, np.full(len(p), sigma), turn, noise, samples) for p in polygons]
    return pack(hulls, lenses) if hulls else noisy.take([])


GOLDEN = 0.6180339887498949


def thinned(sequence: SequenceTask, most: int) -> tuple[SequenceTask, float]:
    """The sequence with at most ``most`` of its sightings, and how many each of those stands for.

    One of each stretch of time, at a place that changes from stretch to stretch: evenly spaced ones would be blind to some vibrations.
    """
    n = len(sequence.task.sightings)
    if n <= most:
        return sequence, 1.0
    rows = np.floor((np.arange(most) + (np.arange(most) * GOLDEN) % 1.0) * n / most).astype(np.int64)
    task = restricted(sequence.task, rows)
    return replace(sequence, task=task, shape=sequence.shape.take(rows)), n / most


def counted(equations: SequenceEquations, times: float) -> SequenceEquations:
    """Equations of sightings that each stand for ``times`` as many with noise of their own."""
    frames = equations.frames
    return replace(
        equations,
        frames=replace(
            frames, H=times * frames.H, g=times * frames.g, weighted=times * frames.weighted, noise=None, known=times * frames.meat
        ),
    )
