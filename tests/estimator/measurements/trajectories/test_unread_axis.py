"""A disc that spins faster than its gyroscope reads: an effect whose own fit leaves the wobble as it is, is no name of what makes it."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories

Array = NDArray[np.float64]
NOISE_RADS = 0.1
MOMENTS, TILT = np.array([0.5, 0.5, 1.0]), np.array([0.03, 0.015, 0.0])


def throw(seed: int, rows: int = 50) -> Trajectory:
    """A thin disc, its third axis never read, by a gyroscope that sits tilted on it; no noise is stated."""
    times = np.arange(rows) / 100.0

    def change(_: float, w: Array) -> Array:
        return np.asarray(np.cross(MOMENTS * w, w) / MOMENTS)

    rng = np.random.default_rng(seed)
    spin = solve_ivp(change, (0.0, times[-1]), [*rng.normal(0.0, 4.0, 2), -43.0], t_eval=times, rtol=1e-10, atol=1e-12).y.T
    read = Rotation.from_rotvec(TILT).apply(spin) + rng.normal(0.0, NOISE_RADS, (rows, 3))
    read[:, 2] = np.nan
    nothing, where = np.full((rows, 3), np.nan), Surroundings(np.zeros(3), Body(np.zeros(3), np.eye(3), MOMENTS))
    return Trajectory("throw", times, nothing, None, None, None, None, None, where, read)


@cache
def explained(seed: int) -> Explanation:
    registered = register_trajectories([throw(seed)])
    return explain(registered.campaign, registered.start, catalogue())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_name_that_its_own_fit_refutes_is_none(seed: int) -> None:
    found = explained(seed)
    (step,) = [each for each in found.steps if each.added == "products_of_inertia"]
    assert step.established
    assert step.group == ("products_of_inertia",)
