"""Distances of outline samples from the outlines that a surface casts, with their derivatives; here those of the calibrated views."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial.transform import Rotation

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.likelihood.rows import noise_scales
from estimator.particle.particle import Particle
from estimator.surface.contact import Contact, Picture, contacts_of, turned
from estimator.surface.shape import own_noise_px
from estimator.surface.star_surface import Surface, crossed

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Residuals ``gap_px`` (m,) of samples in the order of their outlines, ``starts`` (k + 1,) where those of each picture begin.

    ``by_corner`` (m, 3 n) px/m, by each corner's three coordinates in the particle frame, and ``by_motion`` (m, p): their derivatives.
    Where pictures are of one camera, in the order of time, ``by_pose`` (m, 6) px/m and px/rad: those by the pose of their own picture, and
    ``by_slow`` (m, k): those by slow errors of the poses.
    """

    gap_px: Float[NDArray[np.float64], " m"]
    starts: NDArray[np.int64]
    by_corner: csr_array
    by_motion: Float[NDArray[np.float64], "m p"] | csr_array
    by_pose: Float[NDArray[np.float64], "m 6"] | None = None
    by_slow: Float[NDArray[np.float64], "m k"] | None = None


@dataclass(frozen=True)
class MovedViews:
    """A particle's views of ``outlines``, each moved from where its ``calibrated`` pose has it.

    ``moved_px`` (v, 2 or 5): seen that much further right and down and, where calibrations may be off by more, turned about the camera's
    axes, as the rim of a particle of ``radius_m`` about ``centre`` (3,) m, particle frame, moves by it. ``free``: whether that is among the
    unknowns; ``offset_px``: by how much all outlines are drawn too large. ``sd_px``: standard deviation of the moves; ``settled``: whether
    that is known, so that they do not say it themselves.
    """

    outlines: Sequence[Outline]
    calibrated: Sequence[CalibratedView]
    moved_px: Float[NDArray[np.float64], "v k"]
    centre: Float[NDArray[np.float64], " 3"]
    radius_m: float
    sd_px: float
    free: bool = True
    settled: bool = False
    offset_px: float = 0.0

    @property
    def unknown(self) -> Float[NDArray[np.float64], " k"]:
        """By how much they are moved, view by view, where that is among the unknowns."""
        return self.moved_px.ravel() if self.free else np.zeros(0)

    @property
    def shift_px(self) -> Float[NDArray[np.float64], "v 2"]:
        """How much further right and down they are seen."""
        return self.moved_px[:, :2]

    @property
    def _centres(self) -> Float[NDArray[np.float64], "v 3"]:
        """Where each camera has the particle's, m."""
        return np.array([v.R_cam_particle @ self.centre + v.t_cam_particle for v in self.calibrated])

    @property
    def _radius_px(self) -> Float[NDArray[np.float64], " v"]:
        """What each camera sees of it."""
        return np.array([v.intrinsics.fx_px for v in self.calibrated]) * self.radius_m / self._centres[:, 2]

    def samples(self, surface: Surface) -> Samples:
        """Their samples, with derivatives by what is unknown."""
        back = [outline.points_px - by for outline, by in zip(self.outlines, self.shift_px, strict=True)]
        samples, met, across = _of_views(surface, back, self._turned(), self.offset_px)
        if not self.free:
            return samples
        k, count = self.moved_px.shape[1], np.diff(met.starts)
        view = np.repeat(np.arange(len(back)), count)
        by_turn = crossed(across, met.point - self._centres[view]) / self._radius_px[view, None]
        values = np.column_stack([-met.normal, by_turn])[:, :k]
        columns, starts = (k * view[:, None] + np.arange(k)).ravel(), k * np.arange(len(view) + 1)
        return replace(samples, by_motion=csr_array((values.ravel(), columns, starts), shape=(len(view), self.moved_px.size)))

    @property
    def information(self) -> Float[NDArray[np.float64], "k k"]:
        """What is known of those that are unknown beside their samples."""
        return np.eye(len(self.unknown)) / self.sd_px**2

    def moved(self, step: Array, variance: Array) -> "MovedViews":
        """After a ``step`` (k,) of those that are unknown, whose ``variance`` (k,) was known: where it is open, ``sd_px`` as they show."""
        if not self.free:
            return self
        moved_px = self.moved_px + step.reshape(self.moved_px.shape)
        return replace(self, moved_px=moved_px, sd_px=self.sd_px if self.settled else _scale_of(moved_px, variance, self.sd_px))

    @property
    def placed(self) -> tuple[CalibratedView, ...]:
        """Views calibrated so that they are seen where these are: shifts as translations across each camera's axis."""
        by = self.shift_px * (self.radius_m / self._radius_px)[:, None]
        views = zip(self._turned(), by, strict=True)
        return tuple(replace(view, t_cam_particle=view.t_cam_particle + np.append(across, 0.0)) for view, across in views)

    def _turned(self) -> Sequence[CalibratedView]:
        """The poses that they have."""
        if not self.moved_px[:, 2:].any():
            return self.calibrated
        turns = Rotation.from_rotvec(self.moved_px[:, 2:] / self._radius_px[:, None]).as_matrix()
        at = zip(self.calibrated, turns, self._centres, strict=True)
        return [replace(v, R_cam_particle=(R := turn @ v.R_cam_particle), t_cam_particle=c - R @ self.centre) for v, turn, c in at]


def views_of(particle: Particle, offset_px: float) -> MovedViews:
    """A particle's views where they are calibrated; turned, too, where they disagree by more than their outlines explain.

    Free where a fit has moved them to where they are calibrated. ``offset_px``: by how much their outlines are drawn too large.
    """
    count, known_px = len(particle.calibrated), particle.recalibrated_px
    return MovedViews(
        particle.outlines,
        particle.calibrated,
        np.zeros((count, 5 if particle.disagreement.beyond_noise else 2)),
        particle.body.com_particle,
        0.5 * particle.extent_m,
        known_px or own_noise_px(particle.seen),
        free=known_px > 0.0,
        settled=known_px > 0.0,
        offset_px=offset_px,
    )


def _scale_of(moved_px: Array, variance: Array, sd_px: float) -> float:
    """Standard deviation of moves (v, k) at which the evidence is largest, from one at which their ``variance`` (k v,) is known."""
    square, told = np.sum(moved_px**2) / sd_px**2, np.sum(1.0 - variance / sd_px**2)
    return sd_px * float(noise_scales(np.asarray(square), np.asarray(told)))


def _of_views(
    surface: Surface, outlines_px: Sequence[Array], views: Sequence[CalibratedView], offset_px: float
) -> tuple[Samples, Contact, Array]:
    """Samples of outlines, each (s, 2) px, what they meet, and by how much they move with its points (s, 3) px/m, camera coordinates."""
    pictures = [Picture(v.intrinsics, v.R_cam_particle, v.t_cam_particle, o) for o, v in zip(outlines_px, views, strict=True)]
    met = contacts_of(surface, pictures)
    across = turned(met.across(pictures, met.normal), met.starts, np.array([v.R_cam_particle for v in views]))
    return samples_at(surface, met, across, np.zeros((len(across), 0)), offset_px), met, met.across(pictures, met.outward)


def samples_at(surface: Surface, met: Contact, across: Array, by_motion: Array, offset_px: float) -> Samples:
    """Samples by what they meet.

    ``across`` (s, 3) px/m, by how much outlines move with the particle's points, particle frame, and ``by_motion`` (s, p); ``offset_px``
    of the outlines, outwards.
    """
    ends = np.stack([met.first, met.second], axis=1)
    values = np.stack([(met.share - 1.0)[:, None] * across, -met.share[:, None] * across], axis=1)
    columns, starts = 3 * ends[:, :, None] + np.arange(3), 6 * np.arange(len(ends) + 1)
    by_corner = csr_array((values.ravel(), columns.ravel(), starts), shape=(len(ends), surface.vertices.size))
    return Samples(met.gap_px - offset_px, met.starts, by_corner, by_motion)
