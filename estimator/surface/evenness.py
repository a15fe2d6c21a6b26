"""What is believed of a surface before it is seen: it is even but for edges, and its corners are spread evenly over it.

A corner is off the mean of its neighbours, along the normal, by what the surface bends there: none on a plane. Bends have no scale of their
own: a factor between two of them costs the same whatever they are [Jeffreys, Proc. R. Soc. A 186 (1946) 453], so that most are none and
edges stand. It is the limit of a Cauchy distribution whose scale goes to zero, a sum of logarithms [Candès, Wakin and Boyd, Journal of
Fourier Analysis 14 (2008) 877]. A fit comes down to it from a large scale, where bends cost their squares [Blake and Zisserman, Visual
Reconstruction, 1987], by weights made anew in every round [Holland and Welsch, Communications in Statistics A6 (1977) 813].

Moves along an even surface change no outline, so that a corner there is free along its normal alone: along its direction from the centre a
wall that overhangs would not move. Where the surface bends, a corner is free in all three directions: samples then draw it to the edge, and
the mesh comes to run along edges by itself, which a mesh that does not follow them chamfers.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, vstack

from estimator.surface.star_surface import Sphere, Surface

Array = NDArray[np.float64]
BENT = 0.08
"""Bend, in lengths of an edge, beyond which a corner is free along the surface, too: that of a corner on an edge of some 20 degrees. With
0.15 edges of cut stones were left chamfered in trial runs."""
LEAST_BEND = 0.003
"""Scale, in lengths of an edge, below which bends are none: over a face 20 edges wide they add up to a third of an edge, 0.3 pixels of a
recording. With 0.01, flat faces stayed pillows; with 0.001, joint fits did not settle."""
SPREAD = 0.5
"""Standard deviation, in lengths of an edge, of a free corner's place along the surface from the mean of its neighbours; by judgement."""


@dataclass(frozen=True)
class Believed:
    """Weighted rows of a prior on the surface's unknowns, linear in them.

    ``basis`` (3 n, m): moves of the corners by the unknowns (m). ``bends`` (n, m) and ``bend`` (n,): their weighted rows and values, of
    standard deviation one; ``spread`` (k, m) and ``apart`` (k,): those of free corners along the surface, and of bends that are slowed.
    ``corner`` (m,) of the ``sphere`` that each unknown moves.
    """

    basis: csr_array
    bends: csr_array
    bend: Float[NDArray[np.float64], " n"]
    spread: csr_array
    apart: Float[NDArray[np.float64], " k"]
    corner: NDArray[np.int64]
    sphere: Sphere

    @property
    def rows(self) -> csr_array:
        """All rows (n + k, m)."""
        return csr_array(vstack([self.bends, self.spread]))

    @property
    def values(self) -> Array:
        """Their values (n + k,)."""
        return np.concatenate([self.bend, self.apart])


def believed(surface: Surface, scale: float = LEAST_BEND, *, bent: float = BENT) -> Believed:
    """The prior about a surface, of bends beyond a ``scale``, in lengths of an edge; ``bent``: beyond which corners are free."""
    normals, edge_m = surface.normals, surface.edge_m
    off = np.asarray(surface.sphere.laplacian @ surface.vertices)
    bend = np.sum(off * normals, axis=1) / edge_m
    free = np.flatnonzero(np.abs(bend) > bent)
    held = np.setdiff1d(np.arange(len(normals)), free)
    basis, corner = _basis(normals, held, free), np.concatenate([held, np.repeat(free, 3)])
    moved = surface.sphere.by_axis @ basis
    weight = np.sqrt(2.0 / (1.0 + (bend / scale) ** 2)) / scale
    bends = csr_array(diags_array(weight / edge_m) @ _along(normals, np.arange(len(normals))) @ moved)
    tangents = _tangents(normals[free])
    spread = csr_array(vstack([_along(t, free, len(normals)) @ moved for t in tangents]) / (SPREAD * edge_m))
    apart = np.concatenate([np.sum(off[free] * t, axis=1) for t in tangents]) / (SPREAD * edge_m)
    return Believed(basis, bends, bend * weight, spread, apart, corner, surface.sphere)


def slowed(prior: Believed, surface: Surface, within: float) -> Believed:
    """The prior about a surface for one step that changes its bends by about ``within``, in lengths of an edge [Levenberg 1944].

    Samples are linear over no more than that. A spike that one step has thrown up meets no sample, so that nothing would take it back.
    """
    moved = csr_array(surface.sphere.by_axis @ prior.basis) / (within * surface.edge_m)
    return replace(prior, spread=csr_array(vstack([prior.spread, moved])), apart=np.append(prior.apart, np.zeros(moved.shape[0])))


def _basis(normals: Array, held: NDArray[np.int64], free: NDArray[np.int64]) -> csr_array:
    """Moves (3 n, m) of ``held`` corners along their ``normals`` (n, 3), of the ``free`` ones along all axes."""
    rows = np.concatenate([(3 * held[:, None] + np.arange(3)).ravel(), (3 * free[:, None] + np.arange(3)).ravel()])
    columns = np.concatenate([np.repeat(np.arange(len(held)), 3), len(held) + np.arange(3 * len(free))])
    values = np.concatenate([normals[held].ravel(), np.ones(3 * len(free))])
    return csr_array((values, (rows, columns)), shape=(normals.size, len(held) + 3 * len(free)))


def _along(directions: Array, corners: NDArray[np.int64], n: int | None = None) -> csr_array:
    """Rows (k, 3 n) that take the component along ``directions`` (k, 3) of what moves ``corners`` (k,)."""
    k = len(corners)
    columns = (3 * corners[:, None] + np.arange(3)).ravel()
    return csr_array((directions.ravel(), (np.repeat(np.arange(k), 3), columns)), shape=(k, 3 * (k if n is None else n)))


def _tangents(normals: Array) -> tuple[Array, Array]:
    """Two unit vectors (k, 3) across each of ``normals`` (k, 3)."""
    first = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    first = first / np.linalg.norm(first, axis=1)[:, None]
    return first, np.cross(normals, first)
