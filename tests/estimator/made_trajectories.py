"""Trajectories made by another method than the estimator's: Euler's equations in body axes and Newton's, by SciPy's DOP853."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body

Array = NDArray[np.float64]
GRAVITY = np.array([0.0, 0.0, -9.81])
RATE_HZ = 148.0


@dataclass(frozen=True)
class Hidden:
    """What really happens: quadratic drag (1/m), gravity too strong (m/s²), centre of mass beside the tracked point (m), spin (rad/s).

    ``thrust`` (m/s²) is fixed to the body.
    """

    drag: float = 0.0
    more_gravity: float = 0.0
    com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spin_rads: float = 4.0
    thrust: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Tracker:
    """What is measured: rows, the noise of positions (m), turns (rad) and spins (rad/s), and which of them there are."""

    rows: int = 30
    sigma_x: float = 5e-4
    sigma_theta: float = 3e-3
    sigma_omega: float = 0.05
    orientation: bool = True
    spin: bool = False
    stated: bool = False
    ratios: tuple[float, float, float] = (1.0, 1.0, 1.0)


def flown(rng: np.random.Generator, hidden: Hidden, tracker: Tracker) -> tuple[Array, Array, Rotation, Array]:
    """Times (n,), tracked points (n, 3), orientations, and angular velocities (n, 3), world frame, without noise."""
    times, moments = np.arange(tracker.rows) / RATE_HZ, np.array(tracker.ratios)
    gravity = GRAVITY * (1.0 + hidden.more_gravity / 9.81)

    def rate(_: float, y: Array) -> Array:
        v, q, w = y[3:6], y[6:10], y[10:13]
        turn = 0.5 * np.concatenate([q[3] * w + np.cross(q[:3], w), [-q[:3] @ w]])
        pushed = gravity - hidden.drag * np.linalg.norm(v) * v
        if any(hidden.thrust):
            pushed = pushed + Rotation.from_quat(q).apply(hidden.thrust)
        return np.concatenate([v, pushed, turn, np.cross(moments * w, w) / moments])

    start = [
        rng.uniform(-0.3, 0.3, 3),
        [*rng.uniform(-2.0, 2.0, 2), rng.uniform(0.0, 2.0)],
        Rotation.random(rng=rng).as_quat(),
        rng.normal(0, hidden.spin_rads, 3),
    ]
    solved = solve_ivp(rate, (0.0, times[-1]), np.concatenate(start), method="DOP853", t_eval=times, rtol=1e-11, atol=1e-12)
    R = Rotation.from_quat(solved.y[6:10].T)
    return times, solved.y[:3].T - R.apply(hidden.com), R, R.apply(solved.y[10:13].T)


def measured(name: str, rng: np.random.Generator, hidden: Hidden, tracker: Tracker) -> Trajectory:
    """One trajectory with noise."""
    times, x, R, omega = flown(rng, hidden, tracker)
    shape = x.shape
    turned = Rotation.from_rotvec(rng.normal(0.0, tracker.sigma_theta, shape)) * R
    spun = omega + rng.normal(0.0, tracker.sigma_omega, shape)
    body = Body(np.zeros(3), np.eye(3), np.array(tracker.ratios))
    return Trajectory(
        name=name,
        times_s=times,
        x_world=x + rng.normal(0.0, tracker.sigma_x, shape),
        q_world_tracked=turned.as_quat() if tracker.orientation else None,
        omega_world=spun if tracker.spin else None,
        sigma_x=np.full(shape, tracker.sigma_x) if tracker.stated else None,
        sigma_theta=np.full(shape, tracker.sigma_theta) if tracker.stated and tracker.orientation else None,
        sigma_omega=np.full(shape, tracker.sigma_omega) if tracker.stated and tracker.spin else None,
        surroundings=Surroundings(GRAVITY, body),
    )


def campaign(seed: int, hidden: Hidden, tracker: Tracker, *, sequences: int = 4) -> list[Trajectory]:
    """Several trajectories of one thing."""
    rng = np.random.default_rng(seed)
    return [measured(f"toss_{i}", rng, hidden, tracker) for i in range(sequences)]
