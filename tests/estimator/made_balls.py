"""Balls in flight whose spin was read once, of some of them wrongly, and what is found in them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import GRAVITY, RATE_HZ, Hidden, Tracker, measured

Array = np.ndarray
BALL = Tracker(rows=40, sigma_x=1e-3, orientation=False, spin=True, stated=True)
LIFT, SPIN_RADS, SIGMA_RADS = 2e-3, 200.0, 4.0
DRAG, DRAG_OF_LIFT = 0.15, 0.3
"""Of a table tennis ball: over the square of its speed (1/m), and over lift."""


def spin(rng: np.random.Generator) -> Array:
    """A spin across the flight, forth or back, with a part of its own along every axis."""
    return np.array([0.0, rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5) * SPIN_RADS, 0.0]) + rng.normal(0.0, 40.0, 3)


def pushed(omega: Array, v: Array, *, drags: bool) -> Array:
    """Acceleration by gravity and lift; ``drags``: by drag, too, which grows with the spin."""
    lift, speed = LIFT * np.cross(omega, v), np.linalg.norm(v)
    return np.asarray(GRAVITY + lift - drags * (DRAG * speed + DRAG_OF_LIFT * np.linalg.norm(lift) / speed) * v)


def ball(rng: np.random.Generator, name: str, *, wrong: bool, drags: bool) -> Trajectory:
    """A ball in explicit steps of a tenth of a row; where ``wrong``, its reading is that of another ball."""
    x, v, omega, step = np.zeros(3), np.array([8.0, 0.0, 1.0]) + rng.normal(0.0, 0.5, 3), spin(rng), 0.1 / RATE_HZ
    other, seen = spin(rng), [x]
    for _ in range(BALL.rows - 1):
        for _ in range(10):
            half = v + 0.5 * step * pushed(omega, v, drags=drags)
            x, v = x + step * half, v + step * pushed(omega, half, drags=drags)
        seen.append(x)
    made, read = measured(name, rng, Hidden(), BALL), np.full((BALL.rows, 3), np.nan)
    read[BALL.rows // 2] = (other if wrong else omega) + rng.normal(0.0, SIGMA_RADS, 3)
    x_world = np.array(seen) + rng.normal(0.0, BALL.sigma_x, (BALL.rows, 3))
    return replace(made, x_world=x_world, omega_world=read, sigma_omega=read * 0.0 + SIGMA_RADS)


def registered_balls(number: int, wrong: int, seed: int = 7, *, drags: bool = False) -> Registered:
    """A campaign of ``number`` balls, the first of which have ``wrong`` spins."""
    rng = np.random.default_rng(seed)
    return register_trajectories([ball(rng, f"shot_{i}", wrong=i < wrong, drags=drags) for i in range(number)])


def explained_balls(number: int, wrong: int, tried: Sequence[str], seed: int = 7, *, drags: bool = False) -> Explanation:
    """What is found in them, of the effects ``tried``."""
    registered = registered_balls(number, wrong, seed, drags=drags)
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in tried})
