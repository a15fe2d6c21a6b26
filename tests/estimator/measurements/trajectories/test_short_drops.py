"""One short drop of a light ball, filmed from the side, its noise not stated: what drag does to it is no noise."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from datasets.trajectory_files import read_trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories

G, DRAG, NOISE = 9.81, 0.9, 0.004
"""m/s2, 1/m, m."""
TRIED = ("frame_rate", "length_scale", "gravity", "linear_drag", "quadratic_drag", "dropped_frames", "position_distortion")


def drop(folder: Path, drag: float, seed: int) -> Path:
    """A file of 18 rows at 30 Hz: rounded to a millimetre, one row in which the tracker was off."""

    def slowed(_t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        speed = float(np.hypot(y[2], y[3]))
        return np.array([y[2], y[3], -drag * speed * y[2], -G - drag * speed * y[3]])

    rng, times = np.random.default_rng(seed), np.arange(18) / 30.0
    x = solve_ivp(slowed, (0.0, times[-1]), [0.0, 1.0, 0.05, 0.3], t_eval=times, rtol=1e-8).y[:2].T
    x = x + NOISE * rng.normal(size=x.shape)
    x[rng.integers(3, 15)] += [0.03, -0.02]
    lines = "".join(f"{t:.4f},{1e3 * a:.0f},{1e3 * b:.0f}\n" for t, (a, b) in zip(times, x, strict=True))
    path = folder / "drop.csv"
    path.write_text(f"t_s,x_mm,y_mm\n{lines}")
    return path


def explained(path: Path) -> Explanation:
    registered = register_trajectories([read_trajectory(path, {"gravity_world": [0.0, -G, 0.0]})])
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_ball_that_air_slows_by_half_is_said_to_be_slowed(tmp_path: Path, seed: int) -> None:
    """A parabola is off by 35 mm here; taken for noise, that hid a drag that alone leaves 5."""
    found = explained(drop(tmp_path, DRAG, seed))
    assert {"linear_drag", "quadratic_drag"} & set(found.found), found.found
    (step,) = (each for each in found.steps if each.added in ("linear_drag", "quadratic_drag"))
    assert step.established
    assert "quadratic_drag" in step.group


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_of_a_ball_that_nothing_slows_nothing_is_said(tmp_path: Path, seed: int) -> None:
    assert not explained(drop(tmp_path, 0.0, seed)).found
