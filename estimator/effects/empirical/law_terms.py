"""The terms of which a law for an unknown force or torque may consist. Each is one short function that a user's plug-in can hold as it is.

A term's function gets parameters ``theta`` (m, q) and the moment of m flights, and gives (m, 3), world frame: m/s² for a force, rad/s² per
largest moment for a torque. It is linear in its first parameters, the amplitudes; the others (exponents, places) shape it, with
values that are tried first. Powers are taken of a distance over 5 cm, a speed over 1 m/s, a spin over 100 rad/s, so that
an amplitude means the same whatever the exponent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from datasets.vocabulary.effects import Parameter
from estimator.effects.link import Array, Moment
from estimator.geometry.sphere import fibonacci_sphere

Link = Literal["acceleration", "torque"]


def constant(theta: Array, moment: Moment) -> Array:
    """``a``, world axes; ``theta`` (m, 3) m/s² or rad/s²."""
    del moment
    return theta


def ramp(theta: Array, moment: Moment) -> Array:
    """``b t``, world axes, t since the first frame; ``theta`` (m, 3) per second."""
    return theta * moment.time_s


def body_fixed(theta: Array, moment: Moment) -> Array:
    """``R_world_body a``: constant in body axes; ``theta`` (m, 3) m/s² or rad/s²."""
    return np.asarray((moment.R @ theta[:, :, None])[:, :, 0])


def against_velocity(theta: Array, moment: Moment) -> Array:
    """``-c (|v| / 1 m/s)^(n - 1) v``; ``theta`` (m, 2): c, n."""
    speed = np.maximum(np.linalg.norm(moment.v, axis=1, keepdims=True), 1e-9)
    return np.asarray(-theta[:, :1] * speed ** (theta[:, 1:] - 1.0) * moment.v)


def across_velocity(theta: Array, moment: Moment) -> Array:
    """``c omega x v``; ``theta`` (m, 1)."""
    return np.asarray(theta * np.cross(moment.omega, moment.v))


def towards_plane(theta: Array, moment: Moment) -> Array:
    """``-a n (d / 5 cm)^-p``, d = n . x - position the distance from a plane; ``theta`` (m, 5): a, n as two angles, position, p."""
    strength, azimuth, elevation, position, power = theta.T
    n = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=1)
    distance = np.maximum(np.sum(n * moment.x, axis=1) - position, 1e-3)
    return np.asarray((-strength * (distance / 0.05) ** -power)[:, None] * n)


def towards_point(theta: Array, moment: Moment) -> Array:
    """``a u (r / 5 cm)^-p``, r the distance to a point, u the direction to it; ``theta`` (m, 5): a, point, p."""
    strength, power = theta[:, :1], theta[:, 4:]
    away = theta[:, 1:4] - moment.x
    distance = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-3)
    return np.asarray(strength * (distance / 0.05) ** -power * away / distance)


def against_spin(theta: Array, moment: Moment) -> Array:
    """``-c (|omega| / 100 rad/s)^(n - 1) omega``; ``theta`` (m, 2): c, n."""
    spin = np.maximum(np.linalg.norm(moment.omega, axis=1, keepdims=True) / 100.0, 1e-9)
    return np.asarray(-theta[:, :1] * spin ** (theta[:, 1:] - 1.0) * moment.omega)


@dataclass(frozen=True)
class Term:
    """One term.

    ``amplitudes``: how many of the ``parameters`` come in linearly, at the front; ``power``: name of the exponent among the others, if
    there is one, ``powers`` the range it may have and ``usual`` the whole ones that nature prefers, in that order; ``words`` and
    ``formula`` for people; ``positive``: whether an amplitude below zero makes no sense (a drag that drives); ``places``: shapes (s, q)
    tried first, given positions (n, 3) m of the flights.
    """

    key: str
    link: Link
    words: str
    formula: str
    parameters: tuple[Parameter, ...]
    amplitudes: int
    function: Callable[[Array, Moment], Array]
    places: Callable[[Array], Array]
    power: str | None = None
    powers: tuple[float, float] = (0.0, 0.0)
    usual: tuple[float, ...] = ()
    positive: bool = False

    @property
    def shapes(self) -> tuple[Parameter, ...]:
        """The parameters that it is not linear in."""
        return self.parameters[self.amplitudes :]


def _no_places(positions: Array) -> Array:
    del positions
    return np.zeros((1, 0))


def _powers(usual: tuple[float, ...], positions: Array) -> Array:
    del positions
    return np.array([[power] for power in usual])


GAPS_M = (0.005, 0.02, 0.06, 0.2)
"""How far behind the nearest position a plane or point is tried."""
PLANES = 48
"""Directions of planes and points on trial, about 29° apart."""
USUAL_DRAG, USUAL_SPIN, USUAL_PULL = (1.0, 2.0), (1.0, 2.0, 0.0), (2.0, 1.0, 3.0)
"""Exponents that a law takes where the data allow it, the simplest first: drag, spin in air or on a table, and pulls over a distance."""


def _planes(positions: Array) -> Array:
    tried = []
    for n in fibonacci_sphere(PLANES):
        nearest = float((positions @ n).min())
        angles = float(np.arctan2(n[1], n[0])), float(np.arcsin(np.clip(n[2], -1.0, 1.0)))
        tried += [(*angles, nearest - gap, power) for gap in GAPS_M for power in USUAL_PULL]
    return np.array(tried)


def _points(positions: Array) -> Array:
    middle = positions.mean(axis=0)
    radius = float(np.linalg.norm(positions - middle, axis=1).max())
    return np.array([(*(middle + (radius + gap) * n), power) for n in fibonacci_sphere(PLANES) for gap in GAPS_M for power in USUAL_PULL])


def _vector(name: str, unit: str, size: tuple[float, float], axes: str, meaning: str) -> tuple[Parameter, ...]:
    limit, step = size
    return tuple(Parameter(f"{name}_{axis}", unit, (-limit, limit), step, f"{meaning}, along {axis}") for axis in axes)


def _power(name: str, low: float, high: float, meaning: str) -> Parameter:
    return Parameter(name, "1", (low, high), 1e-3, meaning)


def _pull(name: str) -> Parameter:
    return Parameter(name, "m/s2", (-50.0, 50.0), 1e-3, "acceleration at a distance of 5 cm, positive towards it")


def _falls(name: str) -> Parameter:
    return _power(name, 0.0, 6.0, "power p with which it falls with distance")


TERMS: tuple[Term, ...] = (
    Term(
        "constant",
        "acceleration",
        "a constant acceleration",
        "a",
        _vector("a", "m/s2", (20.0, 1e-3), "xyz", "acceleration, world frame"),
        3,
        constant,
        _no_places,
    ),
    Term(
        "body_fixed",
        "acceleration",
        "a thrust that is fixed to the body",
        "R_world_body a",
        _vector("thrust", "m/s2", (20.0, 1e-3), "123", "acceleration, body axes"),
        3,
        body_fixed,
        _no_places,
    ),
    Term(
        "against_velocity",
        "acceleration",
        "a drag along the velocity",
        "-c (|v| / 1 m/s)^(n-1) v",
        (
            Parameter("drag", "1/s", (0.0, 50.0), 1e-3, "rate c at a speed of 1 m/s"),
            _power("velocity_power", 0.0, 4.0, "exponent n of the speed"),
        ),
        1,
        against_velocity,
        partial(_powers, USUAL_DRAG),
        "velocity_power",
        (0.0, 4.0),
        USUAL_DRAG,
        positive=True,
    ),
    Term(
        "across_velocity",
        "acceleration",
        "a lift across velocity and spin",
        "c omega x v",
        (Parameter("lift", "1", (-1.0, 1.0), 1e-5, "lift c"),),
        1,
        across_velocity,
        _no_places,
    ),
    Term(
        "towards_plane",
        "acceleration",
        "an attraction along one axis that depends on the position along it (a wall)",
        "-a n (d / 5 cm)^-p, d = n . x - position",
        (
            _pull("pull"),
            Parameter("azimuth", "rad", (-4.0, 4.0), 1e-3, "direction of n about the z axis, from x"),
            Parameter("elevation", "rad", (-1.6, 1.6), 1e-3, "direction of n above the x-y plane"),
            Parameter("position", "m", (-10.0, 10.0), 1e-4, "where the plane lies along n"),
            _falls("pull_power"),
        ),
        1,
        towards_plane,
        _planes,
        "pull_power",
        (0.0, 6.0),
        USUAL_PULL,
    ),
    Term(
        "towards_point",
        "acceleration",
        "an attraction towards a point",
        "a u (r / 5 cm)^-p, r u = x0 - x",
        (_pull("point_pull"), *_vector("x0", "m", (10.0, 1e-4), "xyz", "the point, world frame"), _falls("point_power")),
        1,
        towards_point,
        _points,
        "point_power",
        (0.0, 6.0),
        USUAL_PULL,
    ),
    Term(
        "ramp",
        "acceleration",
        "an acceleration that grows with time",
        "b t",
        _vector("b", "m/s3", (1000.0, 1e-1), "xyz", "growth of the acceleration, world frame"),
        3,
        ramp,
        _no_places,
    ),
    Term(
        "torque_constant",
        "torque",
        "a constant torque",
        "m",
        _vector("m", "rad/s2", (2e4, 10.0), "xyz", "torque per largest moment, world frame"),
        3,
        constant,
        _no_places,
    ),
    Term(
        "torque_body_fixed",
        "torque",
        "a torque that is fixed to the body",
        "R_world_body m",
        _vector("torque", "rad/s2", (2e4, 10.0), "123", "torque per largest moment, body axes"),
        3,
        body_fixed,
        _no_places,
    ),
    Term(
        "against_spin",
        "torque",
        "a torque against the spin",
        "-c (|omega| / 100 rad/s)^(n-1) omega",
        (
            Parameter("damping", "1/s", (0.0, 50.0), 1e-2, "rate c at a spin of 100 rad/s"),
            _power("spin_power", 0.0, 4.0, "exponent n of the spin"),
        ),
        1,
        against_spin,
        partial(_powers, USUAL_SPIN),
        "spin_power",
        (0.0, 4.0),
        USUAL_SPIN,
        positive=True,
    ),
)
"""All terms, from simple to involved; a clock that starts with every recording is the least likely cause of a force. Those of the catalogue
are among them, so that a law may be a known one beside an unknown one."""
