"""Campaigns of trajectories with a mess: short and long flights, a small push of each, wrong rows, one bad flight, rounded time stamps."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.trajectory import Trajectory
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, measured

Array = NDArray[np.float64]
ROWS = (14, 22, 30, 38, 18, 46, 26, 34)
"""Of the flights: 0.1 to 0.3 s."""
PUSH_MS2 = 0.05
"""Standard deviation of the constant acceleration of every flight, of unknown cause."""
WRONG_ROWS, WRONG_M = 0.03, 0.02
"""Share of the rows that are off, and the standard deviation by which."""
BAD, BAD_M = 3, 4e-3
"""The flight that was tracked badly, and the standard deviation of its rows."""
STAMP_S = 1e-3


def flights(seed: int, hidden: Hidden, *, bad: bool = True, rows: Sequence[int] = ROWS) -> list[Trajectory]:
    """Flights with all of the mess; ``bad``: with the badly tracked one as well."""
    made = [measured(f"flight_{i}", np.random.default_rng([seed, i]), hidden, Tracker(rows=n, sigma_x=3e-4)) for i, n in enumerate(rows)]
    return [_spoilt(each, np.random.default_rng([seed, i, 1]), bad=bad and i == BAD) for i, each in enumerate(made)]


def _spoilt(flight: Trajectory, rng: np.random.Generator, *, bad: bool) -> Trajectory:
    """One flight with its push, its wrong rows and its rounded stamps."""
    times = flight.times_s
    x = flight.x_world + 0.5 * rng.normal(0.0, PUSH_MS2, 3) * times[:, None] ** 2
    wrong = rng.random(len(times)) < WRONG_ROWS
    x = x + wrong[:, None] * rng.normal(0.0, WRONG_M, x.shape) + bad * rng.normal(0.0, BAD_M, x.shape)
    return replace(flight, x_world=x, times_s=np.round(times / STAMP_S) * STAMP_S)


def registered(seed: int, hidden: Hidden, *, bad: bool = True) -> Registered:
    """The campaign of those flights."""
    return register_trajectories(flights(seed, hidden, bad=bad))
