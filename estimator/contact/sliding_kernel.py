"""One rigid impact with Coulomb friction, followed through its normal impulse: compiled code, dimensionless.

Axes are (tangent, tangent, normal). While the contact slides, dp = (-μ t̂, 1) dpₙ with t̂ the direction of sliding. Taking dpₙ = s dτ, s the
sliding speed, removes the singularity at s = 0 [Mirtich 1996, section 3.3; Keller 1986]:

    (ln s)' = t̂·q,  θ' = t̂⊥·q,  q = K_tn - μ K_tt t̂,   uₙ' = s (Kₙₙ - μ Kₙt·t̂),   W' = s uₙ,   pₙ' = s.

Where sliding stops the rest is a straight line in pₙ, sticking or slipping along the one diverging ray, and is finished in closed form.
Integration is Dormand–Prince 5(4) with step control; events are found by Newton steps that a bracket guards.
"""

import math

import numba
import numpy as np

STRONGE, POISSON, NEWTON = 0, 1, 2
"""Which quantity ends restitution: work, normal impulse, or normal velocity."""
SLIPS, STICKS, REVERSES = 0, 1, 2
"""How the contact ended: sliding all the way, stuck, or slipping anew along the diverging ray."""
TOLERANCE = 1e-12
"""Error of one step, over one and the state. By judgement."""
STOPPED = 1e-14
"""Sliding speed over approach speed that counts as none."""
MOST_STEPS = 20000
"""Steps after which a contact's sliding is told as not ended."""
A = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    ]
)
"""Coefficients of the seven stages of an explicit Runge-Kutta pair of order five [Dormand and Prince 1980]."""
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
"""Weights of the stages in the difference of the orders five and four [Dormand and Prince 1980]."""


@numba.njit(cache=True)
def _rates(y, K, mu, out):  # type: ignore[no-untyped-def]
    """Derivatives in τ of y = (θ, ln s, uₙ, W, pₙ)."""
    c, d = math.cos(y[0]), math.sin(y[0])
    s = math.exp(y[1])
    q0 = K[0, 2] - mu * (K[0, 0] * c + K[0, 1] * d)
    q1 = K[1, 2] - mu * (K[1, 0] * c + K[1, 1] * d)
    out[0] = c * q1 - d * q0
    out[1] = c * q0 + d * q1
    out[2] = s * (K[2, 2] - mu * (K[2, 0] * c + K[2, 1] * d))
    out[3] = s * y[2]
    out[4] = s


@numba.njit(cache=True)
def _step(y, h, K, mu, k, new):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """One Dormand–Prince step into ``new``; returns the largest estimated error over what is tolerated."""
    _rates(y, K, mu, k[0])
    for stage in range(1, 7):
        # Rates depend on the first three alone; the last stage is the step itself.
        for i in range(5 if stage == 6 else 3):
            new[i] = y[i]
            for j in range(stage):
                new[i] += h * A[stage, j] * k[j, i]
        _rates(new, K, mu, k[stage])
    worst = 0.0
    for i in range(4):
        error = 0.0
        for j in range(7):
            error += ERROR[j] * k[j, i]
        worst = max(worst, abs(h * error) / (TOLERANCE * (1.0 + abs(new[i]))))
    return worst


@numba.njit(cache=True)
def _goal(y, stop, target):  # type: ignore[no-untyped-def]
    """What ends restitution, less its target."""
    if stop == STRONGE:
        return y[3] - target
    return (y[4] if stop == POISSON else y[2]) - target


@numba.njit(cache=True)
def _locate(y, h, K, mu, component, target, k, new):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Step from ``y`` into ``new`` to where y[component] reaches ``target``, which lies within ``h``."""
    low, high = 0.0, h
    at = h
    for _ in range(80):
        _step(y, at, K, mu, k, new)
        off = new[component] - target
        if off >= 0.0:
            high = at
        else:
            low = at
        _rates(new, K, mu, k[0])
        slope = k[0, component]
        following = at - off / slope if slope > 0.0 else 0.5 * (low + high)
        if not low < following < high:
            following = 0.5 * (low + high)
        if abs(following - at) <= 1e-15 * h:
            break
        at = following


@numba.njit(cache=True)
def _diverging_ray(K, mu):  # type: ignore[no-untyped-def]
    """(λ, t̂) of (λ1 + μK_tt) t̂ = K_tn, |t̂| = 1, λ > 0; λ = 0 where sticking holds, |K_tt⁻¹ K_tn| ≤ μ."""
    a, b, c = mu * K[0, 0], mu * K[0, 1], mu * K[1, 1]
    half, away = 0.5 * (a + c), math.hypot(0.5 * (a - c), b)
    turn = 0.5 * math.atan2(2.0 * b, a - c)
    large, small = half + away, half - away
    v0 = math.cos(turn) * K[0, 2] + math.sin(turn) * K[1, 2]
    v1 = -math.sin(turn) * K[0, 2] + math.cos(turn) * K[1, 2]
    length = math.hypot(v0, v1)
    if (v0 * small) ** 2 + (v1 * large) ** 2 <= (large * small) ** 2 or length == 0.0:
        return 0.0, 0.0, 0.0
    low, high = max(0.0, length - large), length - small
    for _ in range(200):
        middle = 0.5 * (low + high)
        if (v0 / (middle + large)) ** 2 + (v1 / (middle + small)) ** 2 > 1.0:
            low = middle
        else:
            high = middle
        if high - low <= 1e-16 * high:
            break
    x, z = v0 / (high + large), v1 / (high + small)
    size = math.hypot(x, z)
    x, z = x / size, z / size
    return high, math.cos(turn) * x - math.sin(turn) * z, math.sin(turn) * x + math.cos(turn) * z


@numba.njit(cache=True)
def _straight(y, K, mu):  # type: ignore[no-untyped-def]
    """What holds once sliding has stopped: duₙ/dpₙ, and du_t/dpₙ = λ t̂ (none when it sticks)."""
    rate, t0, t1 = _diverging_ray(K, mu)
    if rate > 0.0:
        return K[2, 2] - mu * (K[2, 0] * t0 + K[2, 1] * t1), rate * t0, rate * t1
    determinant = K[0, 0] * K[1, 1] - K[0, 1] * K[1, 0]
    x = (K[1, 1] * K[0, 2] - K[0, 1] * K[1, 2]) / determinant
    z = (K[0, 0] * K[1, 2] - K[1, 0] * K[0, 2]) / determinant
    return K[2, 2] - K[2, 0] * x - K[2, 1] * z, 0.0, 0.0


@numba.njit(cache=True)
def _target(stop, e, approach, work, impulse):  # type: ignore[no-untyped-def]
    """Where restitution ends, from the work and impulse of compression."""
    if stop == STRONGE:
        return (1.0 - e * e) * work
    return (1.0 + e) * impulse if stop == POISSON else e * approach


@numba.njit(cache=True)
def _finish(y, K, e, mu, stop, compressing, approach, work, impulse, target, out):  # type: ignore[no-untyped-def]  # noqa: PLR0913, PLR0917
    """From where sliding has stopped to the end, in closed form; returns how it ended, ``out`` gets u_t after and W of compression."""
    slope, along0, along1 = _straight(y, K, mu)
    if compressing:
        work, impulse = min(work, y[3] - y[2] ** 2 / (2.0 * slope)), y[4] - y[2] / slope
        target = _target(stop, e, approach, work, impulse)
    began = y[2]
    if stop == STRONGE:
        y[2] = math.sqrt(max(0.0, began**2 + 2.0 * slope * (target - y[3])))
    else:
        y[2] = began + slope * (target - y[4]) if stop == POISSON else target
    passed = (y[2] - began) / slope
    y[3] += (y[2] ** 2 - began**2) / (2.0 * slope)
    y[4] += passed
    out[0], out[1], out[3] = along0 * passed, along1 * passed, work
    return REVERSES if along0 != 0.0 or along1 != 0.0 else STICKS


@numba.njit(cache=True)
def follow(K, u, e, mu, stop, out):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Follow one impact; K (3, 3) and u (3,) in units where Kₙₙ and |u| are about 1.

    ``out`` (8,) gets u after (3), W of compression, W at the end, pₙ, how it ended, and 1 when it came to an end at all.
    """
    k, y, new = np.empty((7, 5)), np.empty(5), np.empty(5)
    speed = math.hypot(u[0], u[1])
    y[0], y[1], y[2], y[3], y[4] = math.atan2(u[1], u[0]), math.log(max(speed, 1e-300)), u[2], 0.0, 0.0
    approach, work, impulse, target = -u[2], 0.0, 0.0, 0.0
    compressing, ended, done = True, SLIPS, False
    h, slides = 0.1 / (1.0 + mu), speed > STOPPED
    for _ in range(MOST_STEPS):
        if done or not slides:
            break
        error = _step(y, h, K, mu, k, new)
        if error > 1.0:
            h *= max(0.2, 0.9 * error**-0.2)
            continue
        longer = h * min(5.0, 0.9 * max(error, 1e-10) ** -0.2)
        if compressing and new[2] >= 0.0:
            _locate(y, h, K, mu, 2, 0.0, k, new)
            new[2], compressing = 0.0, False
            work, impulse = min(work, new[3]), new[4]
            target = _target(stop, e, approach, work, impulse)
            done = _goal(new, stop, target) >= 0.0
        elif not compressing and _goal(new, stop, target) >= 0.0:
            _locate(y, h, K, mu, 3 if stop == STRONGE else (4 if stop == POISSON else 2), target, k, new)
            done = True
        elif new[2] < 0.0:
            compressing = True
        y[:] = new
        h, slides = longer, y[1] > math.log(STOPPED)
    out[0], out[1] = math.exp(y[1]) * math.cos(y[0]), math.exp(y[1]) * math.sin(y[0])
    out[7] = 1.0 if done or not slides else 0.0
    if not done and not slides:
        ended = _finish(y, K, e, mu, stop, compressing, approach, work, impulse, target, out)
        work = out[3]
    out[2], out[3], out[4], out[5], out[6] = y[2], work, y[3], y[4], ended


@numba.njit(cache=True)
def follow_many(K, u, e, mu, stop):  # type: ignore[no-untyped-def]
    """:func:`follow` for K (n, 3, 3) and u (n, 3), each made dimensionless first; returns (n, 8) in the units given."""
    results = np.empty((u.shape[0], 8))
    for i in range(u.shape[0]):
        scale, size = K[i, 2, 2], math.sqrt(u[i, 0] ** 2 + u[i, 1] ** 2 + u[i, 2] ** 2)
        follow(K[i] / scale, u[i] / size, e[i], mu[i], stop, results[i])
        results[i, :3] *= size
        results[i, 3:5] *= size * size / scale
        results[i, 5] *= size / scale
    return results
