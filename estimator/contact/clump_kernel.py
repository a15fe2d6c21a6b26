"""A clump of spheres pressed against a plate, integrated through the contact: compiled code, SI units.

Axes are (tangent, tangent, normal) of the plate, at rest in it, the plate at height 0. The state is the centre of mass, the turn since the
start (quaternion, scalar first), velocity, angular momentum, the work of all that is not the elastic normal spring, and two components of
total tangential displacement per sphere. Forces are those of :mod:`estimator.contact.hertz_mindlin`; steps are Dormand–Prince 5(4).

Energy is watched: T + U - D may not change, U = Σ 8/15 E*√R δ^2.5 the springs' energy in closed form and D the work of the rest. A step
too long for the contact breaks that balance at once.
"""

import math

import numba
import numpy as np

from estimator.contact.sliding_kernel import ERROR, A

TOLERANCE = 1e-9
"""Error of one step over the size of each part of the state. By judgement."""
LONGEST = 10.0
"""Longest step over the first, about a 300th of the contact: slips are cut after each step, which the error estimate does not see."""
MOST_STEPS = 200000
"""Steps after which a contact is told as not ended."""
SLIP = 14
"""Where the slips begin in the state."""
DAMPING = 2.0 * math.sqrt(5.0 / 6.0)
"""Factor of a damper beside Hertz's spring that takes a set share of the energy at any speed [Tsuji, Tanaka and Ishida 1992]."""


@numba.njit(cache=True)
def _rotation(y, R):  # type: ignore[no-untyped-def]
    """Rotation matrix of the state's quaternion."""
    size = math.sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2 + y[6] ** 2)
    w, a, b, c = y[3] / size, y[4] / size, y[5] / size, y[6] / size
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (b * b + c * c), 2 * (a * b - w * c), 2 * (a * c + w * b)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (a * b + w * c), 1 - 2 * (a * a + c * c), 2 * (b * c - w * a)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (a * c - w * b), 2 * (b * c + w * a), 1 - 2 * (a * a + b * b)


@numba.njit(cache=True)
def _spin(y, inverse, R, turned, omega):  # type: ignore[no-untyped-def]
    """Angular velocity of the state, and the inverse inertia turned with the body."""
    _rotation(y, R)
    for i in range(3):
        for j in range(3):
            turned[i, j] = 0.0
            for a in range(3):
                for b in range(3):
                    turned[i, j] += R[i, a] * inverse[a, b] * R[j, b]
    for i in range(3):
        omega[i] = turned[i, 0] * y[10] + turned[i, 1] * y[11] + turned[i, 2] * y[12]


@numba.njit(cache=True)
def _depths(y, centres, radii, R, depth, arms):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Depth of every sphere in the plate (below 0: it is clear of it); returns how many touch.

    ``arms`` (2,) gets the sum of lever × normal over those that do.
    """
    touching = 0
    arms[:] = 0.0
    for i in range(radii.shape[0]):
        depth[i] = radii[i] - y[2] - (R[2, 0] * centres[i, 0] + R[2, 1] * centres[i, 1] + R[2, 2] * centres[i, 2])
        if depth[i] > 0.0:
            touching += 1
            arms[0] += R[1, 0] * centres[i, 0] + R[1, 1] * centres[i, 1] + R[1, 2] * centres[i, 2]
            arms[1] -= R[0, 0] * centres[i, 0] + R[0, 1] * centres[i, 1] + R[0, 2] * centres[i, 2]
    return touching


@numba.njit(cache=True)
def _tangential(law, depth, radius, effective, slip, along, limit, out):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Tangential force of spring and damper together, cut at ``limit``; ``out`` gets force (2) and the slip the spring can hold (2).

    The spring alone is cut back to what ``limit`` holds, not to what the damper leaves of it: it would point backwards while sliding.
    """
    stiffness = 8.0 * law[1] * math.sqrt(radius * depth)
    damping = DAMPING * law[2] * math.sqrt(stiffness * effective)
    out[0], out[1] = -stiffness * slip[0] - damping * along[0], -stiffness * slip[1] - damping * along[1]
    total, spring = math.hypot(out[0], out[1]), stiffness * math.hypot(slip[0], slip[1])
    force_share = limit / total if total > limit else 1.0
    slip_share = limit / spring if spring > limit else 1.0
    out[0], out[1] = out[0] * force_share, out[1] * force_share
    out[2], out[3] = slip[0] * slip_share, slip[1] * slip_share


@numba.njit(cache=True)
def _contact(y, i, touching, law, mass, centres, radii, work, out):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Sphere i: ``out`` (13,) gets force (3), slip (2) after the cut, lever (3), velocity (3), elastic normal force."""
    R, turned, omega, depth, arms, tangential = work
    for a in range(2):
        out[5 + a] = R[a, 0] * centres[i, 0] + R[a, 1] * centres[i, 1] + R[a, 2] * centres[i, 2]
    out[7] = R[2, 0] * centres[i, 0] + R[2, 1] * centres[i, 1] + R[2, 2] * centres[i, 2] - radii[i]
    out[8] = y[7] + omega[1] * out[7] - omega[2] * out[6]
    out[9] = y[8] + omega[2] * out[5] - omega[0] * out[7]
    out[10] = y[9] + omega[0] * out[6] - omega[1] * out[5]
    x, z = turned[0, 0] * arms[0] + turned[0, 1] * arms[1], turned[1, 0] * arms[0] + turned[1, 1] * arms[1]
    effective = 1.0 / max(touching / mass + out[6] * x - out[5] * z, 1.0 / mass)
    stiffness = 2.0 * law[0] * math.sqrt(radii[i] * depth[i])
    out[11] = 2.0 / 3.0 * stiffness * depth[i]
    out[2] = max(0.0, out[11] - DAMPING * law[2] * math.sqrt(stiffness * effective) * out[10])
    slip = y[SLIP + 2 * i : SLIP + 2 * i + 2]
    _tangential(law, depth[i], radii[i], effective, slip, out[8:10], law[3] * out[2], tangential)
    out[0], out[1], out[3], out[4] = tangential[0], tangential[1], tangential[2], tangential[3]


@numba.njit(cache=True)
def _rates(y, law, mass, inverse, centres, radii, work, one, out):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Derivatives of the state."""
    R, turned, omega, depth, arms, _ = work
    _spin(y, inverse, R, turned, omega)
    touching = _depths(y, centres, radii, R, depth, arms)
    out[:] = 0.0
    out[0], out[1], out[2] = y[7], y[8], y[9]
    w, a, b, c = y[3], y[4], y[5], y[6]
    out[3] = -0.5 * (omega[0] * a + omega[1] * b + omega[2] * c)
    out[4] = 0.5 * (w * omega[0] + omega[1] * c - omega[2] * b)
    out[5] = 0.5 * (w * omega[1] + omega[2] * a - omega[0] * c)
    out[6] = 0.5 * (w * omega[2] + omega[0] * b - omega[1] * a)
    for i in range(radii.shape[0]):
        if depth[i] <= 0.0:
            continue
        _contact(y, i, touching, law, mass, centres, radii, work, one)
        for k in range(3):
            out[7 + k] += one[k] / mass
        out[10] += one[6] * one[2] - one[7] * one[1]
        out[11] += one[7] * one[0] - one[5] * one[2]
        out[12] += one[5] * one[1] - one[6] * one[0]
        out[13] += (one[2] - one[11]) * one[10] + one[0] * one[8] + one[1] * one[9]
        out[SLIP + 2 * i], out[SLIP + 2 * i + 1] = one[8], one[9]


@numba.njit(cache=True)
def _step(y, h, scale, body, work, one, k, new):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """One Dormand–Prince step into ``new``; returns the largest estimated error over what is tolerated."""
    law, mass, inverse, centres, radii = body
    for stage in range(7):
        for i in range(y.shape[0]):
            new[i] = y[i]
            for j in range(stage):
                new[i] += h * A[stage, j] * k[j, i]
        _rates(new, law, mass, inverse, centres, radii, work, one, k[stage])
    worst = 0.0
    for i in range(y.shape[0]):
        error = 0.0
        for j in range(7):
            error += ERROR[j] * k[j, i]
        worst = max(worst, abs(h * error) / (TOLERANCE * scale[i]))
    return worst


@numba.njit(cache=True)
def _cut_slips(y, body, work, one):  # type: ignore[no-untyped-def]
    """After a step: slips beyond the Coulomb limit fall back to it, those of spheres in the air to none."""
    law, mass, inverse, centres, radii = body
    R, turned, omega, depth, arms, _ = work
    _spin(y, inverse, R, turned, omega)
    touching = _depths(y, centres, radii, R, depth, arms)
    for i in range(radii.shape[0]):
        one[3], one[4] = 0.0, 0.0
        if depth[i] > 0.0:
            _contact(y, i, touching, law, mass, centres, radii, work, one)
        y[SLIP + 2 * i], y[SLIP + 2 * i + 1] = one[3], one[4]
    return touching


@numba.njit(cache=True)
def _energy(y, body, work):  # type: ignore[no-untyped-def]
    """T + U - D (J), of a state whose spin and depths are at hand in ``work``."""
    law, mass, _, _, radii = body
    _, _, omega, depth, _, _ = work
    total = 0.5 * mass * (y[7] ** 2 + y[8] ** 2 + y[9] ** 2) - y[13]
    total += 0.5 * (omega[0] * y[10] + omega[1] * y[11] + omega[2] * y[12])
    for i in range(radii.shape[0]):
        if depth[i] > 0.0:
            total += 8.0 / 15.0 * law[0] * math.sqrt(radii[i]) * depth[i] ** 2.5
    return total


@numba.njit(cache=True)
def _peak(before, after, rate_before, rate_after, h):  # type: ignore[no-untyped-def]
    """Largest value of the cubic through two depths and their rates, where it lies between them."""
    if not rate_before > 0.0 > rate_after:
        return max(before, after)
    bend, cubic = 3.0 * (after - before) / h - 2.0 * rate_before - rate_after, rate_before + rate_after - 2.0 * (after - before) / h
    root = -rate_before / (bend - math.sqrt(max(0.0, bend * bend - 3.0 * cubic * rate_before)))
    return before + h * root * (rate_before + root * (bend + root * cubic))


@numba.njit(cache=True)
def _clearance_step(y, depth, reach):  # type: ignore[no-untyped-def]
    """A time within which no sphere can come to touch, from the greatest speed any point has; ``reach`` bounds lever over inertia."""
    gap = -np.max(depth)
    speed = math.sqrt(y[7] ** 2 + y[8] ** 2 + y[9] ** 2) + reach * math.sqrt(y[10] ** 2 + y[11] ** 2 + y[12] ** 2)
    return gap / max(speed, 1e-300)


@numba.njit(cache=True)
def _lift_off(y, h, scale, body, work, one, k, new):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Step from ``y`` into ``new`` to where the last sphere lifts off, which lies within ``h``; returns the step."""
    low, high = 0.0, h
    for _ in range(60):
        middle = 0.5 * (low + high)
        _step(y, middle, scale, body, work, one, k, new)
        if _cut_slips(new, body, work, one) > 0:
            low = middle
        else:
            high = middle
    _step(y, high, scale, body, work, one, k, new)
    _cut_slips(new, body, work, one)
    return high


@numba.njit(cache=True)
def _deepest(before, depth, k, h):  # type: ignore[no-untyped-def]
    """Greatest depth on a step; between its ends too for a single sphere, whose depth changes as its height does."""
    if depth.shape[0] == 1 and depth[0] > 0.0:
        return _peak(before[0], depth[0], -k[0, 2], -k[6, 2], h)
    return max(0.0, np.max(depth))


@numba.njit(cache=True)
def _following_step(h, error, free, y, depth, first_step, reach, quiet):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """The next adaptive step; in the air, after ``free`` seconds of it, one that cannot pass through the plate."""
    if free < 0.0:
        return min(h * min(5.0, 0.9 * max(error, 1e-10) ** -0.2), LONGEST * first_step)
    return min(max(_clearance_step(y, depth, reach), first_step), max(quiet - free, 1e-12))


@numba.njit(cache=True)
def push(y, body, scale, first_step, fixed_step, quiet, reach):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Integrate ``y`` in place until no sphere has touched for ``quiet`` seconds.

    ``body``: (E*, G*, damping ratio, μ), mass, inverse inertia, centres, radii. ``scale``: sizes that errors are measured by.
    ``first_step`` (s) is for adaptive steps, which a ``fixed_step`` of 0 asks for. Returns time of the last separation, deepest depth,
    energy error over energy before, steps, most spheres at once, and 1 where it came to an end.
    """
    n = body[4].shape[0]
    k, new, one = np.empty((7, y.shape[0])), np.empty(y.shape[0]), np.empty(13)
    work = (np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(n), np.empty(2), np.empty(4))
    most, deepest, off, t, left = _cut_slips(y, body, work, one), 0.0, 0.0, 0.0, -1.0
    at_start, before = _energy(y, body, work), work[3].copy()
    h = fixed_step if fixed_step > 0.0 else first_step
    for steps in range(MOST_STEPS):
        error = _step(y, h, scale, body, work, one, k, new)
        if fixed_step == 0.0 and error > 1.0:
            h *= max(0.2, 0.9 * error**-0.2)
            continue
        touching = _cut_slips(new, body, work, one)
        if touching == 0 and np.max(before) > 0.0:
            t += _lift_off(y, h, scale, body, work, one, k, new)
            left = t
        else:
            deepest = max(deepest, _deepest(before, work[3], k, h))
            t += h
        off = max(off, abs(_energy(new, body, work) - at_start) / at_start)
        y[:] = new
        before[:] = work[3]
        most = max(most, touching)
        free = t - left if left >= 0.0 and touching == 0 else -1.0
        if not math.isfinite(off) or off > 1e3:
            break
        if free >= quiet:
            return left, deepest, off, steps + 1, most, 1.0
        if fixed_step == 0.0:
            h = _following_step(h, error, free, y, work[3], first_step, reach, quiet)
    return t, deepest, off, MOST_STEPS, most, 0.0
