"""The equations of motion of a rigid body on a plate, corner by corner, in steps of fixed length (Runge and Kutta's fourth order).

Coordinates are those of the plate: it lies at ``z = 0``, the body is above, velocities are against the plate's own. ``L' = sum r x F``,
``v' = g + sum F / m``, ``q' = (w, 0) q / 2``; the plate's recoil ``y'' = -sum N / M``. Work and impulses are integrated along. Between
steps the deepest overlap of each corner is noted, and the tangential spring cut to Coulomb's cone. Steps are fixed because the law has
corners of its own (touching, turning, slipping), at which an adaptive rule of high order only stumbles; errors fall with the square of
the step.
"""

import numba
import numpy as np

SIZE = 17
X, Q, V, L, RECOIL, RECOIL_SPEED, NORMAL_WORK, TANGENTIAL_WORK = 0, 3, 7, 10, 13, 14, 15, 16
"""Where each part of a state begins."""
SPRING, IMPULSE = 0, 2
"""The same of a corner: tangential spring force (2,) N, impulse (3,) N s."""
MASS, MOMENTS, GRAVITY, STIFFNESS, TANGENTIAL, FRICTION, RESTITUTION2, YIELD_WORK, PULL_OFF, REACH, CREEP, INVERSE_PLATE = (
    *(0, 1, 4, 7, 8, 9, 10, 11, 12, 13, 14, 15),
)
"""Where each constant lies."""
LEAST_RESTITUTION2 = 0.0025
FEWEST = 10
"""Steps before a body may part; it starts a rounding error above the plate."""


@numba.njit(cache=True)
def restitution2(deepest, c):  # type: ignore[no-untyped-def]
    """The share of a corner's work of compression that it gives back."""
    work = 0.4 * c[STIFFNESS] * deepest**2.5
    if work <= c[YIELD_WORK]:
        return c[RESTITUTION2]
    return max(LEAST_RESTITUTION2, c[RESTITUTION2] * (work / c[YIELD_WORK]) ** -0.25)


@numba.njit(cache=True)
def corner_force(overlap, u, deepest, spring, c):  # type: ignore[no-untyped-def]
    """Force (3,), rate of the tangential spring (2,) and normal load of a corner moving at ``u`` (3,)."""
    fx, fy, fz, sx, sy, load = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if overlap >= deepest:
        effective, share = max(overlap, 0.0), 1.0
    else:
        share = restitution2(deepest, c)
        zero = (1 - share) * deepest
        effective = max(overlap - zero, 0.0) / share
        way = zero - overlap
        if 0 < way < c[REACH]:
            fz = -4 * c[PULL_OFF] * way / c[REACH] * (1 - way / c[REACH])
    if effective > 0:
        load = c[STIFFNESS] * effective**1.5
        fz += load
        cap = c[FRICTION] * load
        if c[TANGENTIAL] > 0:
            stiffness = c[TANGENTIAL] * np.sqrt(effective)
            sx, sy = -stiffness * u[0], -stiffness * u[1]
            if u[2] > 0:
                fall = u[2] / share / (2 * effective)
                sx, sy = sx - spring[0] * fall, sy - spring[1] * fall
            size = np.hypot(spring[0], spring[1])
            cut = 1.0 if size <= cap else cap / size
            fx, fy = cut * spring[0], cut * spring[1]
        else:
            size = max(np.hypot(u[0], u[1]), c[CREEP])
            fx, fy = -cap * u[0] / size, -cap * u[1] / size
    return fx, fy, fz, sx, sy, load


@numba.njit(cache=True)
def turn(q):  # type: ignore[no-untyped-def]
    """The rotation matrix of a quaternion (x, y, z, w) of any length."""
    x, y, z, w = q / np.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@numba.njit(cache=True)
def rates(state, corners, places, deepest, c, d_state, d_corners):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Rates of change of the state and of the corners, into ``d_state`` and ``d_corners``."""
    R = turn(state[Q : Q + 4])
    w = R @ ((R.T @ state[L : L + 3]) / c[MOMENTS : MOMENTS + 3])
    qx, qy, qz, qw = state[Q : Q + 4]
    d_state[:] = 0.0
    d_state[X : X + 3] = state[V : V + 3]
    d_state[Q] = 0.5 * (qw * w[0] + w[1] * qz - w[2] * qy)
    d_state[Q + 1] = 0.5 * (qw * w[1] + w[2] * qx - w[0] * qz)
    d_state[Q + 2] = 0.5 * (qw * w[2] + w[0] * qy - w[1] * qx)
    d_state[Q + 3] = -0.5 * (w[0] * qx + w[1] * qy + w[2] * qz)
    d_state[V : V + 3] = c[GRAVITY : GRAVITY + 3]
    d_state[RECOIL] = state[RECOIL_SPEED]
    u = np.empty(3)
    for i in range(len(places)):
        r = R @ places[i]
        overlap = state[RECOIL] - state[X + 2] - r[2]
        d_corners[i] = 0.0
        if overlap <= 0 and deepest[i] == 0:
            continue
        u[0] = state[V] + w[1] * r[2] - w[2] * r[1]
        u[1] = state[V + 1] + w[2] * r[0] - w[0] * r[2]
        u[2] = state[V + 2] + w[0] * r[1] - w[1] * r[0] - state[RECOIL_SPEED]
        fx, fy, fz, sx, sy, _ = corner_force(overlap, u, deepest[i], corners[i, SPRING : SPRING + 2], c)
        d_corners[i] = np.array([sx, sy, fx, fy, fz])
        d_state[V : V + 3] += np.array([fx, fy, fz]) / c[MASS]
        d_state[L : L + 3] += np.array([r[1] * fz - r[2] * fy, r[2] * fx - r[0] * fz, r[0] * fy - r[1] * fx])
        d_state[RECOIL_SPEED] -= fz * c[INVERSE_PLATE]
        d_state[NORMAL_WORK] += fz * u[2]
        d_state[TANGENTIAL_WORK] += fx * u[0] + fy * u[1]


@numba.njit(cache=True)
def cut_to_cone(spring, overlap, deepest, share, c):  # type: ignore[no-untyped-def]
    """Shorten a tangential ``spring`` (2,), in place, to the friction that its corner's load allows; ``share`` of :func:`restitution2`."""
    effective = overlap if overlap >= deepest else max(overlap - (1 - share) * deepest, 0.0) / share
    cap = c[FRICTION] * c[STIFFNESS] * effective**1.5
    size = np.hypot(spring[0], spring[1])
    if size > cap:
        spring[:] *= cap / size


@numba.njit(cache=True)
def settle(state, corners, places, deepest, c):  # type: ignore[no-untyped-def]
    """After a step: note the deepest overlaps, cut the springs to the cone, forget corners that have parted; how many have not."""
    R = turn(state[Q : Q + 4])
    touching = 0
    for i in range(len(places)):
        overlap = state[RECOIL] - state[X + 2] - (R @ places[i])[2]
        deepest[i] = max(deepest[i], overlap)
        share = restitution2(max(deepest[i], 0.0), c)
        zero = (1 - share) * deepest[i]
        if deepest[i] == 0 or (overlap <= 0 and overlap <= zero - c[REACH]):
            deepest[i] = 0.0
            corners[i, SPRING : SPRING + 2] = 0.0
            continue
        touching += 1
        cut_to_cone(corners[i, SPRING : SPRING + 2], overlap, deepest[i], share, c)
    return touching


@numba.njit(cache=True)
def advance(state, corners, places, deepest, c, step, most):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Take up to ``most`` steps, in place, until no corner touches.

    Returns the number of steps, whether the body has parted, the least work of the normal forces and the largest overlap on the way.
    """
    n = len(places)
    k = np.empty((4, SIZE))
    kc = np.empty((4, n, 5))
    least, largest = state[NORMAL_WORK], 0.0
    for number in range(most):
        rates(state, corners, places, deepest, c, k[0], kc[0])
        rates(state + 0.5 * step * k[0], corners + 0.5 * step * kc[0], places, deepest, c, k[1], kc[1])
        rates(state + 0.5 * step * k[1], corners + 0.5 * step * kc[1], places, deepest, c, k[2], kc[2])
        rates(state + step * k[2], corners + step * kc[2], places, deepest, c, k[3], kc[3])
        state += step / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
        corners += step / 6 * (kc[0] + 2 * kc[1] + 2 * kc[2] + kc[3])
        state[Q : Q + 4] /= np.sqrt(np.sum(state[Q : Q + 4] ** 2))
        touching = settle(state, corners, places, deepest, c)
        least = min(least, state[NORMAL_WORK])
        for i in range(n):
            largest = max(largest, deepest[i])
        if touching == 0 and number >= FEWEST:
            return number + 1, True, least, largest
    return most, False, least, largest
