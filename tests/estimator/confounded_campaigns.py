"""Campaigns in which one of three things is wrong that free flight cannot tell apart: the clock, lengths, or gravity."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.trajectory import Trajectory
from tests.estimator.made_trajectories import RATE_HZ, Hidden, Tracker, flown, measured

Array = NDArray[np.float64]
CONFOUNDED = ("frame_rate", "length_scale", "gravity")
TRACKER = Tracker(rows=41, orientation=False, stated=True)
SCATTER = 0.02
"""Standard deviation of what is wrong, as a share."""


def confounded(seed: int) -> tuple[str, float, list[Trajectory], Array]:
    """What is wrong, its size, three trajectories, and their true velocities (3, 3) in the middle row."""
    rng = np.random.default_rng(seed)
    kind, size = CONFOUNDED[seed % 3], float(rng.normal(0.0, SCATTER))
    hidden = Hidden(more_gravity=9.81 * size) if kind == "gravity" else Hidden()
    flights = [_flight(int(rng.integers(2**31)), f"toss_{i}", hidden) for i in range(3)]
    wrong = {
        "length_scale": lambda t: replace(t, x_world=t.x_world / (1.0 + size)),
        "frame_rate": lambda t: replace(t, times_s=t.times_s * (1.0 + size)),
        "gravity": lambda t: t,
    }[kind]
    return kind, size, [wrong(trajectory) for trajectory, _ in flights], np.array([v for _, v in flights])


def _flight(seed: int, name: str, hidden: Hidden) -> tuple[Trajectory, Array]:
    _, x, _, _ = flown(np.random.default_rng(seed), hidden, TRACKER)
    middle = TRACKER.rows // 2
    return measured(name, np.random.default_rng(seed), hidden, TRACKER), 0.5 * RATE_HZ * (x[middle + 1] - x[middle - 1])
