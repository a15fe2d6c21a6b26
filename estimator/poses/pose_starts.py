"""Starts for the pose search: orientations whose hull has the outline's support function.

Far away, an outline is the weak-perspective image of the body, and its support function h(θ) (distance of the tangent with outward
direction θ) is that of the projected visual hull. Turning the camera about its axis shifts θ; translation is the first harmonic;
distance is a factor. So one FFT per viewing direction ranks all in-plane rotations [cf. Schneider 2014 on support functions], thousands of
orientations for the price of a few Levenberg-Marquardt starts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from estimator.data.views import Poses
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.sphere import fibonacci_sphere
from estimator.geometry.support import support
from estimator.motion.rotation import rotation_from_vector

Array = NDArray[np.float64]
ANGLES = 72
"""Directions, every five degrees, of the support functions that starts are ranked by. By judgement."""


@dataclass(frozen=True)
class StartCatalogue:
    """Support functions of the hull seen from d directions.

    ``R`` (d, 3, 3) from particle axes to those of a camera looking along each, ``support`` (d, ANGLES) m, ``middle`` (d, 2) m their
    Steiner points.
    """

    R: Array
    support: Array
    middle: Array


def start_catalogue(hull_vertices: Array, centre: Array, *, directions: int = 600) -> StartCatalogue:
    """Support functions of ``hull_vertices`` (v, 3) m about ``centre`` (3,) m, particle frame, from evenly spread directions."""
    points = hull_vertices - centre
    points = points[ConvexHull(points).vertices]
    R = _looking_along(fibonacci_sphere(directions))
    reach = np.stack([support(points @ each[:2].T, _outward()) for each in R])
    return StartCatalogue(R=R, support=reach, middle=_steiner(reach))


def likely_starts(outline_xy: Array, catalogue: StartCatalogue, *, count: int, separation_rad: float = 0.15) -> Poses:
    """The ``count`` best-matching orientations, at least ``separation_rad`` apart; cost is the mismatch, relative.

    ``outline_xy`` (n, 2): hull vertices in ideal normalised image coordinates.
    """
    seen = np.max(outline_xy @ _outward().T, axis=0)
    seen_middle = _steiner(seen[None])[0]
    target = np.fft.rfft(seen)
    models = np.fft.rfft(catalogue.support, axis=1)
    target[1], models[:, 1] = 0.0, 0.0
    correlation = np.fft.irfft(target[None] * np.conj(models), n=ANGLES, axis=1)
    energy = np.sum(np.fft.irfft(models, n=ANGLES, axis=1) ** 2, axis=1)
    inverse_depth = correlation / energy[:, None]
    mismatch = 1.0 - correlation * inverse_depth / np.sum(np.fft.irfft(target, n=ANGLES) ** 2)
    order = np.argsort(mismatch, axis=None)[: 40 * count]
    direction, shift = np.unravel_index(order, mismatch.shape)
    turn = 2.0 * np.pi * shift / ANGLES
    R = rotation_from_vector(turn[:, None] * np.array([0.0, 0.0, 1.0])) @ catalogue.R[direction]
    keep = _apart(R, count, separation_rad)
    depth = 1.0 / inverse_depth[direction, shift][keep]
    middle = np.einsum(
        "nij,nj->ni", rotation_from_vector(turn[keep, None] * np.array([0.0, 0.0, 1.0]))[:, :2, :2], catalogue.middle[direction[keep]]
    )
    centre = np.column_stack([seen_middle * depth[:, None] - middle, depth])
    return Poses(R=R[keep], centre_cam=centre, cost=mismatch[direction, shift][keep])


def distinct(poses: Poses, *, separation_rad: float) -> Poses:
    """The best of each cluster of orientations, by ascending cost."""
    order = np.argsort(poses.cost)
    order = order[np.isfinite(poses.cost[order])]
    if len(order) == 0:
        return poses.take(order)
    return poses.take(order[_apart(poses.R[order], len(order), separation_rad)])


def _outward() -> Array:
    return unit_circle(ANGLES)


def _steiner(support: Array) -> Array:
    return np.asarray(2.0 / ANGLES * support @ _outward())


def _looking_along(directions: Array) -> Array:
    """Rotations (d, 3, 3) whose third row is each direction."""
    helper = np.where(np.abs(directions[:, 2:]) < 0.9, np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]]))
    x = np.cross(helper, directions)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(directions, x), directions], axis=1)


def _apart(R: Array, count: int, separation_rad: float) -> NDArray[np.int64]:
    """Greedy choice of at most ``count`` rotations, in order, no two closer than ``separation_rad``."""
    chosen: list[int] = []
    q = Rotation.from_matrix(R).as_quat()
    for i in range(len(q)):
        if not chosen or np.max(np.abs(q[chosen] @ q[i])) < np.cos(separation_rad / 2.0):
            chosen.append(i)
            if len(chosen) == count:
                break
    return np.array(chosen, dtype=np.int64)
