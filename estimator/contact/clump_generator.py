"""Fills a convex hull with a given number of spheres so that outlines differ least, and says by how much they do.

Every outline of a convex body is its support function h(d) = max over the body of x·d, seen across the line of sight. A clump inside the
hull has max over spheres of (c·d + r) ≤ h(d): the gap between the two, over directions all around, is the outline error (m). Candidates are
spheres that touch at least three faces: for a range of radii r the corners of the hull shrunk by r. They are taken greedily, each time the
one that leaves the smallest sum of squared gaps [the idea of Ferellec & McDowell 2010, with outlines for surface points].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from datasets.errors import InputError
from estimator.contact.clump import Clump, clump_within
from estimator.contact.constants import require_positive
from estimator.contact.solid import SolidHull

Array = NDArray[np.float64]
DIRECTIONS = 800
"""Directions, about 7° apart, over which a clump is compared with its hull. By judgement."""
RADII = 10
"""Sizes of candidates, from the smallest asked for to nearly the largest that fits."""
LARGEST = 0.98
"""Largest candidates over the largest sphere that fits: a hull shrunk by all of it has no corners."""


@dataclass(frozen=True)
class OutlineError:
    """Gap (m) between the hull's outlines and the clump's, over directions all around: its RMS and the largest."""

    rms_m: float
    largest_m: float


def generated_clump(particle: SolidHull, spheres: int, *, smallest_radius_m: float) -> Clump:
    """A clump of at most ``spheres`` spheres, none smaller than ``smallest_radius_m``; fewer where more would add nothing.

    Raises
    ------
    InputError
        Where the number is below 1, or the smallest radius does not fit the hull.
    """
    if spheres < 1:
        raise InputError(f"clump: expected at least 1 sphere, got {spheres}")
    require_positive(smallest_radius_m, "smallest radius of the clump's spheres", "m")
    faces = np.unique(ConvexHull(particle.vertices_body).equations.round(14), axis=0)
    centre, largest = _largest_sphere(faces)
    if smallest_radius_m > largest:
        raise InputError(f"clump: expected a smallest radius that fits the hull, up to {largest:.4g} m, got {smallest_radius_m:.4g} m")
    centres, radii = _candidates(faces, centre, largest, smallest_radius_m)
    around = directions_around(DIRECTIONS)
    chosen = _taken_greedily(centres @ around.T + radii[:, None], support(particle.vertices_body, around), spheres)
    return clump_within(particle, centres[chosen], radii[chosen])


def outline_error(clump: Clump, vertices_body: Array, directions: Array) -> OutlineError:
    """How far the outlines of ``clump`` lie inside those of the hull of ``vertices_body`` (v, 3) m in body ``directions`` (k, 3)."""
    reached = (clump.centres_body @ directions.T + clump.radii[:, None]).max(axis=0)
    gaps = support(vertices_body, directions) - reached
    return OutlineError(float(np.sqrt(np.mean(gaps**2))), float(gaps.max()))


def support(vertices: Array, directions: Array) -> Array:
    """Support function (k,) m of the hull of ``vertices`` (v, 3) m in ``directions`` (k, 3), one frame."""
    return np.asarray((vertices @ directions.T).max(axis=0))


def directions_around(count: int) -> Array:
    """Unit vectors (count, 3) spread evenly over the sphere along a golden spiral."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    return np.column_stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])


def _largest_sphere(faces: Array) -> tuple[Array, float]:
    """Centre and radius of the largest sphere inside, by linear programming."""
    rows = np.column_stack([faces[:, :3], np.ones(len(faces))])
    size = float(np.abs(faces[:, 3]).max())
    found = linprog([0.0, 0.0, 0.0, -1.0], A_ub=rows, b_ub=-faces[:, 3] / size, bounds=[(None, None)] * 3 + [(0.0, None)])
    solution = np.asarray(found.x, dtype=np.float64)
    return solution[:3] * size, float(solution[3]) * size


def _candidates(faces: Array, centre: Array, largest: float, smallest: float) -> tuple[Array, Array]:
    """Centres and radii of spheres that touch three faces or more, and the largest that fits."""
    centres, radii = [centre[None]], [np.array([largest * (1.0 - 1e-9)])]
    for radius in np.geomspace(min(smallest, LARGEST * largest), LARGEST * largest, RADII).tolist():
        shrunk = np.column_stack([faces[:, :3], (faces[:, 3] + radius) / largest])
        corners = HalfspaceIntersection(shrunk, centre / largest).intersections * largest
        centres.append(corners)
        radii.append(np.full(len(corners), radius * (1.0 - 1e-9)))
    return np.concatenate(centres), np.concatenate(radii)


def _taken_greedily(reached: Array, hull: Array, count: int) -> NDArray[np.int64]:
    """Rows of ``reached`` (candidate, direction) that together come closest to ``hull`` (direction,)."""
    best, chosen = np.full(len(hull), -np.inf), []
    left = np.inf
    for _ in range(count):
        squares = ((hull - np.maximum(reached, best)) ** 2).sum(axis=1)
        following = int(np.argmin(squares))
        if squares[following] >= left:
            break
        left = float(squares[following])
        chosen.append(following)
        best = np.maximum(best, reached[following])
    return np.array(chosen, dtype=np.int64)
