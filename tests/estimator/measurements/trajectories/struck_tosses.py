"""Tosses of a box on to a board at z = 0, by an integrator of their own: DOP853 to the event, an impulse at the corner, and on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body

Array = NDArray[np.float64]
GRAVITY, RATE_HZ = np.array([0.0, 0.0, -9.81]), 148.0
RATIOS = np.array([0.6, 0.8, 1.0])
RADIUS2 = 0.01 / 6.0
"""Largest moment of inertia over mass, m²: that of a solid cube with these corners."""
CORNERS = 0.05 * np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], dtype=np.float64)
SIGMA_X, SIGMA_THETA = 3e-5, 1e-3


@dataclass(frozen=True)
class Hit:
    """Time (s), and (v, omega) before and after it, world frame."""

    time_s: float
    before: Array
    after: Array


@dataclass(frozen=True)
class Toss:
    """Rows and the hits that happened within them."""

    trajectory: Trajectory
    hits: tuple[Hit, ...]


def _rate(_: float, y: Array) -> Array:
    """x, v, quaternion (scalar last), angular velocity in body axes."""
    v, q, w = y[3:6], y[6:10], y[10:13]
    turn = 0.5 * np.concatenate([q[3] * w + np.cross(q[:3], w), [-q[:3] @ w]])
    return np.concatenate([v, GRAVITY, turn, np.cross(RATIOS * w, w) / RATIOS])


def _lowest(_: float, y: Array) -> float:
    return float(y[2] + Rotation.from_quat(y[6:10]).apply(CORNERS)[:, 2].min())


_lowest.terminal, _lowest.direction = True, -1.0  # type: ignore[attr-defined]


def _world(y: Array) -> Array:
    return np.concatenate([y[3:6], Rotation.from_quat(y[6:10]).apply(y[10:13])])


def _struck(y: Array, push: float) -> Array:
    """After an impulse at the lowest corner: normal velocity to -0.5 of itself at ``push`` 1, friction 0.15."""
    R = Rotation.from_quat(y[6:10])
    arms = R.apply(CORNERS)
    r = arms[int(np.argmin(arms[:, 2]))]
    inverse = R.as_matrix() @ np.diag(1.0 / (RADIUS2 * RATIOS)) @ R.as_matrix().T
    u = y[3:6] + np.cross(_world(y)[3:], r)
    along = np.append(u[:2] / max(float(np.hypot(*u[:2])), 1e-9), 0.0)
    direction = np.array([0.0, 0.0, 1.0]) - 0.15 * along
    gain = (direction + np.cross(inverse @ np.cross(r, direction), r))[2]
    p = push * 1.5 * abs(u[2]) / gain * direction
    omega = _world(y)[3:] + inverse @ np.cross(r, p)
    return np.concatenate([y[:3], y[3:6] + p, y[6:10], R.inv().apply(omega)])


def toss(
    rng: np.random.Generator,
    *,
    rows: int = 40,
    height: float = 0.12,
    start: float = 0.0,
    pushes: tuple[tuple[float, float], ...] = ((0, 1),),
) -> Toss:
    """A toss measured from ``start`` (s) on; at the hit each of ``pushes`` acts its delay (s) after it, with its share of the impulse."""
    y = np.concatenate(
        [[0.1, 0.2, height], [*rng.uniform(-0.5, 0.5, 2), -0.4], Rotation.random(rng=rng).as_quat(), rng.normal(0.0, 4.0, 3)]
    )
    times, end = np.arange(rows) / RATE_HZ, rows / RATE_HZ
    parts: list[tuple[float, float, object]] = []
    now, hits = 0.0, []
    first = solve_ivp(_rate, (now, end), y, method="DOP853", dense_output=True, events=_lowest, rtol=1e-10, atol=1e-11)
    parts.append((now, float(first.t[-1]), first.sol))
    now, y = float(first.t[-1]), first.y[:, -1]
    for delay, push in pushes if first.status == 1 else ():
        if delay:
            between = solve_ivp(_rate, (now, now + delay), y, method="DOP853", dense_output=True, rtol=1e-10, atol=1e-11)
            parts.append((now, now + delay, between.sol))
            now, y = now + delay, between.y[:, -1]
        before, y = _world(y), _struck(y, push)
        hits.append(Hit(now, before, _world(y)))
    last = solve_ivp(_rate, (now, max(end, now + 1e-3)), y, method="DOP853", dense_output=True, rtol=1e-10, atol=1e-11)
    parts.append((now, end, last.sol))
    states = np.array([next(sol for a, b, sol in reversed(parts) if t >= a)(t) for t in times])  # type: ignore[operator]
    return Toss(_measured(rng, times, states), tuple(hits))


def lying(toss_: Toss, rng: np.random.Generator, *, until: int, rows: int) -> Trajectory:
    """The first ``until`` rows of a toss, after which it lies where it is for ``rows`` more."""
    t = toss_.trajectory
    assert t.q_world_tracked is not None
    x, q = t.x_world[:until], t.q_world_tracked[:until]
    x = np.vstack([x, x[-1] + rng.normal(0.0, SIGMA_X, (rows, 3))])
    q = np.vstack([q, (Rotation.from_rotvec(rng.normal(0.0, SIGMA_THETA, (rows, 3))) * Rotation.from_quat(q[-1])).as_quat()])
    return Trajectory("lying", np.arange(len(x)) / RATE_HZ, x, q, None, None, None, None, t.surroundings)


def _measured(rng: np.random.Generator, times: Array, states: Array) -> Trajectory:
    x = states[:, :3] + rng.normal(0.0, SIGMA_X, (len(states), 3))
    R = Rotation.from_rotvec(rng.normal(0.0, SIGMA_THETA, (len(states), 3))) * Rotation.from_quat(states[:, 6:10])
    surroundings = Surroundings(GRAVITY, Body(np.zeros(3), np.eye(3), RATIOS))
    return Trajectory("toss", times, x, R.as_quat(), None, None, None, None, surroundings)
