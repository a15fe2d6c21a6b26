"""Volume, centre of mass and inertia of the merged views' hull, with how far they may be off, read off hulls of half the views.

A hull of k views is too large by a volume that falls with 1 / k: measured on a cut stone, Deimos and 1998 KY26 (0.2 px) 8.8, 6.3 and
5.9% of six views, 1.9, 1.1 and 1.1% of 24, 0.8, 0.4 and 0.3% of 60 (``scripts/trials/study_shape.py``). A hull of half the views is thus
too large by twice as much, and what it has more than the whole is what the whole has too much; that is taken off, and half of it is the
standard deviation. Views of one direction are in the same half: of a stone that lay alike in every drop a half would else be the
whole. Centre and moments are those of the whole hull; how far those of the halves are from them is their standard deviation.

Hollows that no view looks into stay filled whatever the number of views: of a body with such hollows the volume is an upper bound. What
outlines show to be hollow stands for as much that they do not show, so the standard deviation of the volume contains the empty share of
their convex hulls. (Three scanned stones with shares of 0.03, 0.03 and 0.07 had volumes too large by 0.03, 0.02 and 0.05.)
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.body import Body
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.hollows import hollow_beyond_noise
from estimator.geometry.visual_hull import visual_hull
from estimator.merging.consistency import LOOP_RAD
from estimator.particle.exact_hull import exact_hull
from estimator.particle.mass_properties import body_of, solid_of
from estimator.particle.particle import LEAST_HOLLOW, MINIMUM_VIEWS, TOLERANCE_PX

Array = NDArray[np.float64]
SPLITS = 2
"""Divisions of the views into halves."""


@dataclass(frozen=True)
class Solid:
    """Mass properties of a uniform body: ``surface`` (m), ``volume_m3`` with ``volume_sigma_m3``, ``excess`` (relative) that was taken off.

    ``body``: centre of mass, axes and moments of the hull; ``com_sigma_m`` of one coordinate, ``inertia_sigma`` of a moment over the
    largest. ``sigmas`` are infinite where views are too few to be halved.
    """

    surface: SurfaceMesh
    volume_m3: float
    volume_sigma_m3: float
    excess: float
    body: Body
    com_sigma_m: float
    inertia_sigma: float


def solid_figures(
    outlines: Sequence[Outline], views: Sequence[CalibratedView], rng: np.random.Generator, *, hull: SurfaceMesh | None = None
) -> Solid:
    """The figures of all views together; ``hull``: their exact hull, where it is there already."""
    surface = hull or _hull(outlines, views)
    hollow = max(hollow_beyond_noise([outline.points_px for outline in outlines]) - LEAST_HOLLOW, 0.0)
    volume, body = float(solid_of(surface).volume), body_of(surface)
    ways = ways_of_looking(views, body.com_particle)
    halves = [_hull([outlines[i] for i in rows], [views[i] for i in rows]) for rows in _halves(ways, rng)]
    if not halves:
        return Solid(surface, volume, float("inf"), 0.0, body, float("inf"), float("inf"))
    bodies = [body_of(half) for half in halves]
    more = max(float(np.mean([solid_of(half).volume for half in halves])) - volume, 0.0)
    com = np.array([b.com_particle - body.com_particle for b in bodies])
    ratios = np.array([b.inertia_ratios[:2] - body.inertia_ratios[:2] for b in bodies])
    return Solid(
        surface=surface,
        volume_m3=volume - more,
        volume_sigma_m3=float(np.hypot(0.5 * more, hollow * volume)),
        excess=more / volume,
        body=body,
        com_sigma_m=float(np.sqrt(np.mean(com**2))),
        inertia_sigma=float(np.sqrt(np.mean(ratios**2))),
    )


def ways_of_looking(views: Sequence[CalibratedView], middle: Array) -> NDArray[np.int64]:
    """The number (n,) of the direction from which each view looks at the body's ``middle`` (3,) m.

    Directions, or their opposites, that are apart by less than a loop of motions may miss are one: they show the same outline.
    """
    from_middle = np.stack([-v.R_cam_particle.T @ v.t_cam_particle - middle for v in views])
    looking = from_middle / np.linalg.norm(from_middle, axis=1, keepdims=True)
    return np.asarray(connected_components(csr_array(np.abs(looking @ looking.T) >= np.cos(LOOP_RAD)), directed=False)[1], dtype=np.int64)


def _halves(ways: NDArray[np.int64], rng: np.random.Generator) -> list[NDArray[np.int64]]:
    """Views of either half of the ways of looking, several times; none of too few ways."""
    count = int(ways.max()) + 1
    if count < 2 * MINIMUM_VIEWS:
        return []
    orders = [rng.permutation(count) for _ in range(SPLITS)]
    return [np.flatnonzero(np.isin(ways, half)) for order in orders for half in (order[: count // 2], order[count // 2 :])]


def _hull(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> SurfaceMesh:
    try:
        return exact_hull(outlines, views, tolerance_px=TOLERANCE_PX)
    except InputError:
        return visual_hull(outlines, views)
