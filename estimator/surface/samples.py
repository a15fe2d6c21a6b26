"""Distances of outline samples from the outlines that a surface casts, with their derivatives; here those of the calibrated views."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array

from datasets.observation import CalibratedView
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.surface.contact import Contact, Picture, contacts_of
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """Residuals ``gap_px`` (m,) of samples in the order of their outlines, ``starts`` (k + 1,) where those of each picture begin.

    ``by_corner`` (m, 3 n) px/m, by each corner's three coordinates in the particle frame, and ``by_motion`` (m, p): their derivatives.
    """

    gap_px: Float[NDArray[np.float64], " m"]
    starts: NDArray[np.int64]
    by_corner: csr_array
    by_motion: Float[NDArray[np.float64], "m p"] | csr_array


def samples_of_views(surface: Surface, outlines: Sequence[Outline], views: Sequence[CalibratedView], offset_px: float = 0.0) -> Samples:
    """Those of the calibrated views, which no motion moves; ``offset_px``: by how much their outlines are drawn too large."""
    return _of_views(surface, [o.points_px for o in outlines], views, offset_px)[0]


@dataclass(frozen=True)
class ShiftedViews:
    """A particle's views of ``outlines``, each seen ``shift_px`` (v, 2) further right and down than its ``calibrated`` pose has it.

    ``free``: whether the shifts are among the unknowns; ``offset_px``: by how much all outlines are drawn too large.
    """

    outlines: Sequence[Outline]
    calibrated: Sequence[CalibratedView]
    shift_px: Float[NDArray[np.float64], "v 2"]
    free: bool = True
    offset_px: float = 0.0

    @property
    def unknown(self) -> Float[NDArray[np.float64], " k"]:
        """The shifts that are among the unknowns, view by view."""
        return self.shift_px.ravel() if self.free else np.zeros(0)

    def samples(self, surface: Surface) -> Samples:
        """Their samples, with derivatives by the shifts that are unknown."""
        back = [outline.points_px - by for outline, by in zip(self.outlines, self.shift_px, strict=True)]
        samples, contacts = _of_views(surface, back, self.calibrated, self.offset_px)
        view = np.repeat(np.arange(len(contacts)), np.diff(samples.starts))
        columns, starts = (2 * view[:, None] + np.arange(2)).ravel(), 2 * np.arange(len(view) + 1)
        normals = np.concatenate([met.normal for met in contacts])
        by_shift = csr_array((-normals.ravel(), columns, starts), shape=(len(view), self.shift_px.size))
        return replace(samples, by_motion=by_shift if self.free else by_shift[:, :0])

    def moved(self, step: Array) -> "ShiftedViews":
        """After a ``step`` (k,) of those that are unknown."""
        return replace(self, shift_px=self.shift_px + step.reshape(-1, 2)) if self.free else self


def _of_views(
    surface: Surface, outlines_px: Sequence[Array], views: Sequence[CalibratedView], offset_px: float
) -> tuple[Samples, list[Contact]]:
    """Samples of outlines, each (s, 2) px, and what they meet."""
    contacts = contacts_of(
        surface, [Picture(v.intrinsics, v.R_cam_particle, v.t_cam_particle, o) for o, v in zip(outlines_px, views, strict=True)]
    )
    across = [across_of(met, view.intrinsics) @ view.R_cam_particle for met, view in zip(contacts, views, strict=True)]
    return stacked(surface, [(met, a, np.zeros((len(a), 0))) for met, a in zip(contacts, across, strict=True)], offset_px), contacts


def across_of(met: Contact, camera: Intrinsics) -> Array:
    """By how much (s, 3) px/m the cast outline moves along its normal where the body's points move, camera coordinates."""
    x, y, z = met.point.T
    u, v = met.normal[:, 0] * camera.fx_px, met.normal[:, 1] * camera.fy_px
    return np.column_stack([u / z, v / z, -(u * x + v * y) / z**2])


def stacked(surface: Surface, parts: Sequence[tuple[Contact, Array, Array]], offset_px: float) -> Samples:
    """All pictures' samples.

    ``parts``: of each picture its contact, and by how much the outline moves, px, with the particle's points (s, 3), per m, and with
    motions (s, p), particle frame. ``offset_px`` of the outlines, outwards.
    """
    n = len(surface.vertices)
    counts = np.array([len(met.gap_px) for met, _, _ in parts], dtype=np.int64)
    first, second = (np.concatenate([getattr(met, name) for met, _, _ in parts]) for name in ("first", "second"))
    share, across = np.concatenate([met.share for met, _, _ in parts]), np.concatenate([a for _, a, _ in parts])
    rows, axis = np.repeat(np.arange(len(share)), 3), np.arange(3)
    values = np.concatenate([(-(1.0 - share)[:, None] * across).ravel(), (-share[:, None] * across).ravel()])
    columns = np.concatenate([(3 * corner[:, None] + axis).ravel() for corner in (first, second)])
    by_corner = csr_array((values, (np.concatenate([rows, rows]), columns)), shape=(len(share), 3 * n))
    gap = np.concatenate([met.gap_px for met, _, _ in parts]) - offset_px
    return Samples(gap, np.concatenate([[0], np.cumsum(counts)]), by_corner, np.concatenate([f for _, _, f in parts]))
