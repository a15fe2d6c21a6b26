"""A free flight as textbooks have it: a parabola, and Euler's equations by the classical Runge-Kutta method."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.body import Body
from datasets.vocabulary.state import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Flight:
    """The state at time 0: ``x`` m, ``v`` m/s, the rotation ``q`` (world from body, scalar last) and ``omega`` rad/s, world frame."""

    x: Array
    v: Array
    q: Array
    omega: Array

    def moved(self, step: Float[NDArray[np.float64], "12"]) -> "Flight":
        """Another state: a step of x, v, the rotation (vector, world frame) and omega."""
        turned = (Rotation.from_rotvec(step[6:9]) * Rotation.from_quat(self.q)).as_quat()
        return Flight(self.x + step[:3], self.v + step[3:6], turned, self.omega + step[9:])


def motion_of(flight: Flight, times_s: Float[NDArray[np.float64], " n"], body: Body, gravity: Float[NDArray[np.float64], "3"]) -> Motion:
    """Where the body is at times (ascending, s; before 0, too), without any force but gravity (m/s², world frame)."""
    t = np.asarray(times_s)[:, None]
    q, omega = _turned(flight, np.asarray(times_s), body.inertia_ratios)
    return Motion(np.asarray(times_s), flight.x + flight.v * t + 0.5 * gravity * t**2, q, flight.v + gravity * t, omega)


@dataclass(frozen=True)
class Told:
    """What a rival found.

    The ``flight`` from the instant ``at_s`` on (after the first time of the clock), with the ``covariance`` (12, 12) of x, v, rotation
    and omega there, of a ``body``; ``rows`` of the clock are the frames used.
    """

    flight: Flight
    at_s: float
    covariance: Array
    body: Body
    rows: NDArray[np.int64]


def estimate_of(obs: Observation, told: Told) -> Estimate:
    """What a rival tells, as an estimate. The covariance of omega is taken to be the same at all times; that of v is."""
    times, body = obs.clock.times_s, told.body
    motion = motion_of(told.flight, times - times[0] - told.at_s, body, obs.gravity_world)
    both = np.array([3, 4, 5, 9, 10, 11])
    shared = told.covariance[np.ix_(both, both)]
    used = set(told.rows.tolist())
    instants = [
        VelocityEstimate(float(times[k]), motion.v_world[k], motion.omega_world[k], shared, shared) for k in (0, (len(times) - 1) // 2)
    ]
    return Estimate(
        name=obs.name,
        status=Status.CONVERGED,
        message="",
        body=body,
        motion=Motion(times, motion.x_world, motion.q_world_body, motion.v_world, motion.omega_world),
        start=instants[0],
        middle=instants[1],
        frames=tuple(FrameReport(0, k, k in used, "" if k in used else "not seen whole", 0.0, 0.0) for k in range(len(times))),
        statistics={"n_views": len(obs.views)},
    )


def _turned(flight: Flight, times: Array, ratios: Array) -> tuple[Array, Array]:
    """Orientations (n, 4) and angular velocities (n, 3); a step of the method for each interval of time, at most 0.1 rad long."""
    momentum = Rotation.from_quat(flight.q).apply(ratios * Rotation.from_quat(flight.q).apply(flight.omega, inverse=True))
    spin = float(np.linalg.norm(flight.omega))
    later = _steps(flight.q, momentum, ratios, (times[times >= 0], spin))
    earlier = _steps(flight.q, momentum, ratios, (times[times < 0][::-1], spin))
    turns = np.array(earlier[::-1] + later)
    rotation = Rotation.from_quat(turns)
    return turns, rotation.apply(rotation.apply(np.tile(momentum, (len(turns), 1)), inverse=True) / ratios)


def _steps(q: Array, momentum: Array, ratios: Array, when: tuple[Array, float]) -> list[Array]:
    times, spin = when
    found, before = [], 0.0
    for now in times:
        steps = max(1, int(np.ceil(spin * abs(now - before) / 0.1))) if now != before else 0
        for _ in range(steps):
            q = _step(q, momentum, ratios, (now - before) / steps)
        before = now
        found.append(q)
    return found


def _step(q: Array, momentum: Array, ratios: Array, dt: float) -> Array:
    first = _rate(q, momentum, ratios)
    second = _rate(q + 0.5 * dt * first, momentum, ratios)
    third = _rate(q + 0.5 * dt * second, momentum, ratios)
    fourth = _rate(q + dt * third, momentum, ratios)
    moved = q + dt / 6 * (first + 2 * second + 2 * third + fourth)
    return moved / np.sqrt(moved @ moved)


def _rate(q: Array, momentum: Array, ratios: Array) -> Array:
    """``dq/dt = q (0, omega_body) / 2`` with the angular momentum (world frame) kept [Goldstein, Classical Mechanics, ch. 4 and 5]."""
    x, y, z, w = q
    matrix = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    a, b, c = (momentum @ matrix) / ratios / (q @ q)
    return 0.5 * np.array([w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c])
