"""What a plate says to a flight with impacts: the particle does not reach into it, and at an impact it touches it.

``h`` is the height of the hull's lowest corner over the plane at an instant: at each impact, and at the lowest picture of each free flight.
It is off by the hull's own error ``sigma`` and by where the plate really stands: ``h = gap + e - A u``, ``u`` (3,) how far the plate is off
its nominal plane (along the normal, turned about two tangents), in units of its standard deviations.

* Not to penetrate means ``gap >= 0``: the likelihood is ``Phi(z)``, ``z = (h + A u) / sigma``, and the cost ``-log Phi(z)``, which is flat
  where the particle is clear of the plate and ``z² / 2`` deep inside. With ``l = phi(z) / Phi(z)`` its slope is ``-l`` and its curvature
  ``l (l + z)``, between 0 and 1: an inequality says less than an equation, and the covariance knows it.
* To touch means ``gap = 0``: the cost is ``z² / 2``.

The plate's three parameters are fitted within each evaluation (convex, Newton's method) and eliminated from the normal equations by their
Schur complement. So a plate that is known exactly, one that is known roughly and one that is only guessed differ in numbers alone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import log_ndtr

from datasets.vocabulary.plate import Plate
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.motion.flight import flown, poses_and_sensitivity
from estimator.motion.piecewise import TIME, PiecewiseFlight, moves_at, moves_of_place, named, segment_of, touch_and_sensitivity

Array = NDArray[np.float64]
NEWTON_STEPS = 30
"""Newton's, at most, of the plate's three parameters; the cost is convex."""
DEEPEST_Z = -30.0
"""Standard deviations inside the plate beyond which the cost is the parabola it tends to."""


@dataclass(frozen=True)
class PlateTask:
    """A plate that is held against a flight.

    ``plate`` counts time from ``began_s``. ``spread`` (3, 3): how far it may be off, standard deviations as columns over (shift along the
    normal in m, turns about the tangents of :func:`tangents` in rad). ``vertices`` (v, 3) m of the hull, nominal body axes, from the
    nominal centre; ``sigma_m`` of its surface. ``kept_out``: the particle may not reach into it; ``touched``: at impacts it touches.
    """

    plate: Plate
    began_s: float
    spread: Float[NDArray[np.float64], "3 3"]
    vertices: Float[NDArray[np.float64], "v 3"]
    sigma_m: float
    kept_out: bool
    touched: bool


@dataclass(frozen=True)
class Gaps:
    """Heights ``h`` (k,) m of lowest corners over the nominal plane, and their derivatives.

    ``moves`` (k, 3, p): of the corner as seen from the plate, m, by the flight's parameters. ``A`` (k, 3) m per standard
    deviation along the plate's axes: of the gap by the plate's. ``equal`` (k,): where the gap is zero, and not only no less.
    """

    h: Array
    moves: Array
    A: Array
    equal: NDArray[np.bool_]


@dataclass(frozen=True)
class PlateHeld:
    """What the plate adds to the normal equations of the flight, and the plate itself.

    ``u`` (3,) in standard deviations along the plate's axes and its ``precision`` (3, 3), without unit, given the flight; ``coupling``
    (3, p) of it with the flight's parameters.
    """

    equations: NormalEquations
    u: Array
    precision: Array
    coupling: Array


def tangents(normal: Float[NDArray[np.float64], "3"]) -> Float[NDArray[np.float64], "2 3"]:
    """Two unit directions along the plane, at right angles; the first as near to an axis of the world as the normal allows."""
    first = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = first - (first @ normal) * normal
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])


def stated_spread(plate: Plate) -> Array:
    """``spread`` (3, 3) of a plate as it was stated."""
    return np.diag([plate.offset_sigma_m, plate.normal_sigma_rad, plate.normal_sigma_rad])


def held_by_plate(task: PlateTask, flight: PiecewiseFlight, times_s: Array) -> PlateHeld:
    """Normal equations (p, p) of the plate's cost at a flight whose pictures were taken at ``times_s`` (f,)."""
    gaps = gaps_of(task, flight, times_s)
    u = plate_off(gaps, task.sigma_m)
    z = (gaps.h + gaps.A @ u) / task.sigma_m
    cost, slope, curvature = penalty(z, gaps.equal)
    J = turned_normal(task, u) @ gaps.moves
    WA = gaps.A * (curvature / task.sigma_m**2)[:, None]
    WJ = J * (curvature / task.sigma_m**2)[:, None]
    precision, coupling = gaps.A.T @ WA + np.eye(3), gaps.A.T @ WJ
    H = J.T @ WJ - coupling.T @ np.linalg.solve(precision, coupling)
    g = J.T @ slope / task.sigma_m
    return PlateHeld(NormalEquations(0.5 * (H + H.T), g, float(cost.sum()) + 0.5 * float(u @ u)), u, precision, coupling)


def turned_normal(task: PlateTask, u: Array) -> Array:
    """The normal (3,) of the plate that is off by ``u`` (3,) standard deviations along its axes, to first order."""
    n = task.plate.normal_world
    return np.asarray(n + (task.spread @ u)[1:] @ np.cross(tangents(n), n))


def penalty(z: Array, equal: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Cost, slope and curvature (k,) each of gaps over their standard deviation.

    ``z``, ``equal`` (k,): the gaps, and which are to be nought.
    """
    clipped = np.maximum(z, DEEPEST_Z)
    ratio = np.exp(-0.5 * clipped**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(clipped))
    deep = z < DEEPEST_Z
    cost = np.where(deep, 0.5 * z**2 - 0.5 * clipped**2 - log_ndtr(clipped), -log_ndtr(clipped))
    slope = np.where(deep, z, -ratio)
    curvature = np.where(deep, 1.0, ratio * (ratio + clipped))
    return np.where(equal, 0.5 * z**2, cost), np.where(equal, z, slope), np.where(equal, 1.0, curvature)


def plate_off(gaps: Gaps, sigma_m: float) -> Array:
    """How far the plate is off (3,), in standard deviations, where gaps and what was known of it agree best."""
    u = np.zeros(3)
    for _ in range(NEWTON_STEPS):
        _, slope, curvature = penalty((gaps.h + gaps.A @ u) / sigma_m, gaps.equal)
        H = gaps.A.T @ (gaps.A * (curvature / sigma_m**2)[:, None]) + np.eye(3)
        step = np.linalg.solve(H, gaps.A.T @ slope / sigma_m + u)
        u = u - step
        if np.abs(step).max() < 1e-9:
            break
    return u


def gaps_of(task: PlateTask, flight: PiecewiseFlight, times_s: Array) -> Gaps:
    """The gaps that count: at each impact, and where the particle is kept out at the lowest picture of each free flight.

    ``times_s`` (f,) of the pictures.
    """
    rows = [_gap_at_impact(task, flight, number) for number in range(len(flight.bounces))]
    equal = [task.touched] * len(rows)
    if task.kept_out:
        rows += _lowest_gaps(task, flight, times_s)
        equal += [False] * (len(rows) - len(equal))
    h, moves, A = (np.array(part) for part in zip(*rows, strict=True))
    return Gaps(h, moves, A @ task.spread, np.array(equal))


_Gap = tuple[float, Array, Array]


def _gap_at_impact(task: PlateTask, flight: PiecewiseFlight, number: int) -> _Gap:
    """Height of the lowest corner at an impact, its derivatives by the flight (time of impact included) and by the plate."""
    touch, S = touch_and_sensitivity(flight, number)
    n = task.plate.normal_world
    arms = (task.vertices - flight.first.com) @ touch.R[0].T
    arm = arms[int(np.argmin(arms @ n))]
    moves = moves_of_place(touch, S, arm)
    moves[:, flight.layout[named(TIME, number)]] -= task.plate.velocity_world[:, None]
    return _gap(task, touch.x[0] + arm, flight.bounces[number].time_s, moves)


def _lowest_gaps(task: PlateTask, flight: PiecewiseFlight, times_s: Array) -> list[_Gap]:
    seen = flown(flight, times_s)
    n = task.plate.normal_world
    low = (task.vertices @ (seen.R[:, 0].transpose(0, 2, 1) @ n).T).min(axis=0)
    away = seen.centre[:, 0] - task.plate.point_world - task.plate.velocity_world * (times_s - task.began_s)[:, None]
    heights, segment = away @ n + low, segment_of(flight, times_s)
    rows = [int(r[np.argmin(heights[r])]) for k in np.unique(segment) for r in [np.flatnonzero(segment == k)]]
    at, S = poses_and_sensitivity(flight, times_s[rows])
    gaps = []
    for k, row in enumerate(rows):
        arms = task.vertices @ at.R[k, 0].T
        arm = arms[int(np.argmin(arms @ n))]
        gaps.append(_gap(task, at.centre[k, 0] + arm, float(times_s[row]), moves_at(S[k], arm)))
    return gaps


def _gap(task: PlateTask, place: Array, time_s: float, moves: Array) -> _Gap:
    """Over a plate shifted by d and turned by a about tangent t the gap is h - d + a (t x n) . lever."""
    plate = task.plate
    lever = place - plate.point_world - plate.velocity_world * (time_s - task.began_s)
    turns = np.cross(tangents(plate.normal_world), plate.normal_world) @ lever
    return float(lever @ plate.normal_world), moves, np.array([-1.0, *turns])
