"""What it says of two flights that the bodies touch when their velocities jump: the gap between their hulls is nought there.

One camera hardly sees depth, and where two particles touch depends on it. So at the shared time the signed gap of the two hulls
(:mod:`estimator.pairs.nearest`) counts as one more measurement of nought, with the hulls' own error: cost ``gap² / 2 sigma²``. Its
derivative is that of the two nearest places along the common normal. It ties the two depths where the contact faces the camera, and says
little where the normal lies in the picture.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.impacts.plate_gap import HULL_SHARE, hull_in_body
from estimator.motion.piecewise import moves_of_place, touch_and_sensitivity
from estimator.pairs.nearest import Nearest, nearest
from estimator.pairs.pair_fit import PairFlight
from estimator.particle.particle import Particle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Hulls:
    """``vertices`` (v, 3) m of both hulls in nominal body axes from their centres, and ``sigma_m`` (2,) of their surfaces."""

    vertices: tuple[Array, Array]
    sigma_m: Array


def hulls_of(particles: tuple[Particle, Particle]) -> Hulls:
    """Both hulls as the calibrated views show them."""
    return Hulls((hull_in_body(particles[0]), hull_in_body(particles[1])), np.array([HULL_SHARE * p.extent_m for p in particles]))


def touching(pair: PairFlight, hulls: Hulls) -> NormalEquations:
    """Normal equations (p,) of the gap at the impact."""
    gap, J = gap_and_derivative(pair, hulls)
    variance = float(hulls.sigma_m @ hulls.sigma_m)
    return NormalEquations(H=np.outer(J, J) / variance, g=J * gap / variance, cost=0.5 * gap**2 / variance)


def gap_and_derivative(pair: PairFlight, hulls: Hulls) -> tuple[float, Array]:
    """The gap (m) and its derivative (p,) by the pair's parameters."""
    touches = [touch_and_sensitivity(flight, 0) for flight in pair.both]
    near = nearest_at(pair, hulls, [t.x[0] for t, _ in touches], [t.R[0] for t, _ in touches])
    J = np.zeros(pair.layout.size)
    for (touch, S), place, sign in zip(touches, pair.places, (1.0, -1.0), strict=True):
        J[place] += sign * near.normal @ moves_of_place(touch, S, near.point - touch.x[0])
    return near.gap_m, J


def nearest_at(pair: PairFlight, hulls: Hulls, places: list[Array], turns: list[Array]) -> Nearest:
    """The nearest features for centres of mass at ``places`` (3,) m and orientations ``turns`` (3, 3), world from nominal body axes."""
    first, second = (
        place + (body - flight.first.com) @ R.T for place, body, R, flight in zip(places, hulls.vertices, turns, pair.both, strict=True)
    )
    return nearest(first, second)
