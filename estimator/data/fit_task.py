"""What a fit needs besides a start: sightings, views, priors and weights."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.data.seen_by import SeenBy
from estimator.data.views import Views
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.outline_bias import OutlineBias
from estimator.geometry.silhouettes import Silhouettes, near_unsure
from estimator.motion.flight import LAYOUT

Array = NDArray[np.float64]
OUTWARD: Array = unit_circle(720)
"""Directions (720, 2) in the picture, half a degree apart, from the x axis on: an arc of 100 px is known to 0.001 px."""


@dataclass(frozen=True)
class Sightings:
    """The silhouettes of a sequence that are used: hull ``n`` was seen by camera ``camera[n]`` in frame ``frame[n]`` at ``times_s[n]``.

    ``camera``, ``frame``, ``times_s`` (n,). ``outlines_px`` (v, 2) of each with its hollows, as seen, and ``unsure`` (v,) which of those
    points may not be the particle's edge, empty where all are; none where they are not known.
    """

    silhouettes: Silhouettes
    camera: NDArray[np.int64]
    frame: NDArray[np.int64]
    times_s: Array
    cameras: tuple[HsvCamera, ...]
    outlines_px: tuple[Array, ...] = ()
    unsure: tuple[NDArray[np.bool_], ...] = ()

    def __len__(self) -> int:
        return len(self.frame)

    @cached_property
    def seen(self) -> SeenBy:
        """The camera of each."""
        return SeenBy(self.cameras, self.camera)

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """For each sighting (n,) the number of the first one of its camera."""
        by_camera = [np.flatnonzero(self.camera == number) for number in range(len(self.cameras))]
        return np.array([rows[np.argmin(self.times_s[rows])] if len(rows) else 0 for rows in by_camera], dtype=np.int64)[self.camera]

    @cached_property
    def in_time(self) -> tuple[NDArray[np.int64], ...]:
        """Those of each camera that has some, by number, in the order of time."""
        order = np.argsort(self.times_s, kind="stable")
        each = (order[self.camera[order] == number] for number in range(len(self.cameras)))
        return tuple(rows for rows in each if len(rows))

    @cached_property
    def furthest_px(self) -> Array:
        """Points (n, a, 2) px of the outlines that lie furthest along :data:`OUTWARD`."""
        outlines = (self.silhouettes.points_px[self.silhouettes.slice_of(i)] for i in range(len(self)))
        return np.stack([points[np.argmax(points @ OUTWARD.T, axis=0)] for points in outlines])

    @cached_property
    def rows_px(self) -> Array:
        """Middle (n,) of the rows that the outlines cover, px below the camera's middle row."""
        y = self.furthest_px[..., 1]
        middle = np.array([(c.intrinsics.height_px - 1) / 2 for c in self.cameras])[self.camera]
        return np.asarray(0.5 * (y.min(axis=1) + y.max(axis=1)) - middle)

    @property
    def R_cam_world(self) -> Array:
        """Rotation (n, 3, 3) from world to the camera of each sighting."""
        return np.stack([c.R_cam_world for c in self.cameras])[self.camera]

    @property
    def t_cam_world(self) -> Array:
        """Translation (n, 3) m from world to the camera of each sighting."""
        return np.stack([c.t_cam_world for c in self.cameras])[self.camera]

    def take(self, rows: NDArray[np.int64]) -> "Sightings":
        """The sightings ``rows`` (k,) alone."""
        outlines = tuple(self.outlines_px[i] for i in rows) if self.outlines_px else ()
        unsure = tuple(self.unsure[i] for i in rows) if self.unsure else ()
        silhouettes = self.silhouettes.take(rows.tolist())
        return Sightings(silhouettes, self.camera[rows], self.frame[rows], self.times_s[rows], self.cameras, outlines, unsure)

    def sure_px(self, number: int) -> Array:
        """Points (s, 2) px of an outline that are the particle's edge, in its order: those away from unsure ones."""
        points = self.outlines_px[number]
        unsure = self.unsure[number] if self.unsure else np.zeros(0, dtype=np.bool_)
        return points[~near_unsure(points, points, unsure)] if unsure.any() else points


@dataclass(frozen=True)
class Prior:
    """Standard deviations of what free flight alone would leave loose.

    ``com_m``: centre of mass (m); ``inertia`` and ``inertia_products``: inertia on and off the diagonal, relative; ``offset_px``: outline
    offset.
    """

    com_m: float
    inertia: float
    inertia_products: float
    offset_px: float

    @property
    def known(self) -> dict[str, Array | float]:
        """Information by the name of its block."""
        inertia = np.array([self.inertia**-2] * 2 + [self.inertia_products**-2] * 3)
        return {"com": self.com_m**-2, "inertia": inertia, "offset": self.offset_px**-2}

    @property
    def precision(self) -> Array:
        """Diagonal (21,) of the prior's information matrix."""
        return LAYOUT.held(self.known).precision


@dataclass(frozen=True)
class FitTask:
    """What a trajectory fit needs besides a start; ``weight`` (sighting, view), 0 leaves a pair out.

    ``bias`` of the outlines, where predicted, is for the last refinement (:func:`unbiased_errors`); earlier fits do without.
    """

    sightings: Sightings
    views: Views
    prior: Prior
    huber: float
    weight: Array
    bias: OutlineBias | None = None


def restricted(task: FitTask, rows: NDArray[np.int64]) -> FitTask:
    """The same task with the sightings ``rows`` (k,) alone."""
    bias = task.bias.take(rows) if task.bias is not None else None
    return FitTask(task.sightings.take(rows), task.views, task.prior, task.huber, task.weight[rows], bias)
