"""What the samples of a sequence's outlines meet of a surface, kept while poses hardly move.

A sample's distance from the outline that the surface casts changes with the body's point that it meets and along the normal there; that the
point slides along the outline changes nothing to first order (envelope theorem). So which point each sample meets is found once, and again
where a fit has moved the outlines: between, a residual costs no search. Samples within a sector of an outline, as seen from its middle, are
averaged: their noise is new in each, and what they say of a motion is nearly the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.sparse import csr_array

from estimator.appearance.sector_shape import sectors_of
from estimator.data.fit_task import Sightings
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.surface.amplitudes import Amplitudes
from estimator.surface.contact import Contact, Picture, contacts_of, turned
from estimator.surface.samples import samples_at
from estimator.surface.star_surface import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
EVENED = 5
"""Samples whose mean place decides on a sector: a fifth of a sample's own noise is left in it."""
MOVED_PX = 0.5
"""Root mean square by which points of the outlines may move before what samples meet is found anew: a radius of 30 px then bends away by
0.004 px."""
SHIFTED = 5
"""Times that what samples meet is found at most, the outline shifted onto the surface's: four shifts. By judgement."""
SECTORS = 64
"""Of an outline: four to six samples each, within which noise may be alike. By judgement."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """What each of s samples of n outlines meets, and of every sector how many samples it has and what amplitudes do there.

    Attributes
    ----------
    sighting, cell : Array
        (s,) the outline, and the sector among all ``n * SECTORS``.
    point : Array
        (s, 3) m that is met, particle frame, with the surface as it was.
    normal : Array
        (s, 2) outward in the picture.
    count : Array
        (n, SECTORS) samples.
    by_sample : csr_array
        (s, 3 c) px/m, of every sample's residual by the corners' coordinates.
    by_amplitude : Array
        (n, SECTORS, m) px of the mean residual by the surface's amplitudes.
    amplitude : Array
        (m,) those that the surface had.
    placed : PoseSet
        Poses at which the points were met.
    """

    sighting: Index
    cell: Index
    point: Float[NDArray[np.float64], "s 3"]
    normal: Float[NDArray[np.float64], "s 2"]
    count: Float[NDArray[np.float64], "n k"]
    by_sample: csr_array
    by_amplitude: Float[NDArray[np.float64], "n k m"]
    amplitude: Float[NDArray[np.float64], " m"]
    placed: PoseSet

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Sectors (n, k) that have samples."""
        return self.count > 0

    @cached_property
    def mean_normal(self) -> Array:
        """Means (n, SECTORS, 2) of the normals."""
        return self.mean(self.normal)

    def mean(self, values: Array) -> Array:
        """Means (n, k, ...) over sectors of ``values`` (s, ...) of samples; zero where there is none."""
        return np.asarray((self._averaging @ values.reshape(len(values), -1)).reshape(*self.count.shape, *values.shape[1:]))

    @cached_property
    def by_corner(self) -> csr_array:
        """Derivatives (n * SECTORS, 3 c) px/m of the mean residual of every sector by the corners' coordinates."""
        return csr_array(self._averaging @ self.by_sample)

    @cached_property
    def _averaging(self) -> csr_array:
        """The matrix (n * SECTORS, s) that takes means."""
        size = self.count.ravel()
        return csr_array((1.0 / size[self.cell], (self.cell, np.arange(len(self.cell)))), shape=(len(size), len(self.cell)))

    def with_amplitudes(self, amplitudes: Amplitudes, here: Array) -> "Contacts":
        """With what ``amplitudes`` do of which the surface has those that are ``here`` (m,)."""
        moved = self.by_corner @ amplitudes.moves if amplitudes.count else np.zeros((self.count.size, 0))
        return replace(self, by_amplitude=np.asarray(moved).reshape(*self.count.shape, -1), amplitude=here)

    def take(self, rows: Index) -> "Contacts":
        """Those of the sightings ``rows`` (k,), in ascending order, alone."""
        number = np.full(len(self.count), -1)
        number[rows] = np.arange(len(rows))
        kept = number[self.sighting] >= 0
        sighting = number[self.sighting[kept]]
        return Contacts(
            sighting=sighting,
            cell=sighting * SECTORS + self.cell[kept] % SECTORS,
            point=self.point[kept],
            normal=self.normal[kept],
            count=self.count[rows],
            by_sample=csr_array(self.by_sample[kept]),
            by_amplitude=self.by_amplitude[rows],
            amplitude=self.amplitude,
            placed=PoseSet(self.placed.R[rows], self.placed.t[rows]),
        )


def contacts_at(amplitudes: Amplitudes, amplitude: Array, sightings: Sightings, placed: PoseSet, samples_px: Array) -> Contacts:
    """What samples meet of a surface with an ``amplitude`` (m,) at poses of the sightings.

    ``samples_px`` (s, 2) of all outlines, one after the other, in a camera without optical effects.
    """
    surface, lenses = amplitudes.surface_at(amplitude), [sightings.cameras[int(k)].intrinsics for k in sightings.camera]
    counts = [len(outline) for outline in sightings.outlines_px]
    outlines_px = np.split(samples_px, np.cumsum(counts)[:-1])
    pictures = [Picture(lens, *each) for lens, *each in zip(lenses, placed.R, placed.t, outlines_px, strict=True)]
    met = _met_in_place(surface, pictures)
    across = turned(met.across(pictures, met.normal), met.starts, placed.R)
    point = turned(met.point - np.repeat(placed.t, counts, axis=0), met.starts, placed.R)
    sighting = np.repeat(np.arange(len(counts)), counts)
    cell = sighting * SECTORS + _sectors(outlines_px)
    count = np.bincount(cell, minlength=len(counts) * SECTORS).astype(np.float64).reshape(-1, SECTORS)
    by_corner = samples_at(surface, met, across, np.zeros((len(across), 0)), 0.0).by_corner
    made = Contacts(sighting, cell, point, met.normal, count, by_corner, np.zeros((*count.shape, 0)), amplitude, placed)
    return made.with_amplitudes(amplitudes, amplitude)


def _met_in_place(surface: Surface, pictures: Sequence[Picture]) -> Contact:
    """What samples meet of a surface, with every outline shifted onto the one that the surface casts there.

    Samples of one that lies beside it, as where a frame's time is wrong, would meet the facets that they happen to lie near, not those that
    they show. Residuals are linear in such a shift, whatever its size.
    """
    placed, found = list(pictures), contacts_of(surface, pictures).parts()
    beside = list(range(len(placed)))
    for _ in range(SHIFTED - 1):
        steps = {i: np.linalg.lstsq(found[i].normal, found[i].gap_px, rcond=None)[0] for i in beside}
        beside = [i for i, step in steps.items() if step @ step >= MOVED_PX**2]
        for i in beside:
            placed[i] = replace(placed[i], samples_px=placed[i].samples_px - steps[i])
        if not beside:
            break
        for i, met in zip(beside, contacts_of(surface, [placed[i] for i in beside]).parts(), strict=True):
            found[i] = met
    return Contact.together(found)


def _sectors(outlines_px: Sequence[Array]) -> Index:
    """Sector of every sample by where it and its neighbours lie, seen from the middle of its outline's points.

    By its own place, a sample that its noise moves out of a step along the line of sight would count for the next sector: means over
    sectors of rough bodies then receded as blurred outlines do.
    """
    even = (uniform_filter1d(outline, EVENED, axis=0, mode="wrap") for outline in outlines_px)
    return np.concatenate([sectors_of(points, points.mean(axis=0), SECTORS) for points in even])
