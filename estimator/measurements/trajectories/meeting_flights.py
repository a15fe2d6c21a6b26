"""Where two measured flights meet: one pose at a continuous time of impact, and what both flights then say.

The flights a and b have been fitted apart, with covariances. At the impact time t their poses must agree:

    g(t) = pose_b(t) - pose_a(t) = 0 ± S_c.

t is found by generalised least squares, with S = J_a C_a J_aᵀ + J_b C_b J_bᵀ + S_c, and both flights are corrected by the same step
(a Kalman update with t unknown); the covariance of all three goes on to position, turn and velocities at t.

A contact of no duration has S_c = 0. One that lasts has no single t: as long as all parts of the impulse act with one time course, the
flights still meet at its centroid in time, but where, say, friction acts later than pressure or a second corner comes down, a part of the
jump Δ happens at another time, and poses miss by Δ times that. So S_c = s² |Δ|² / 3 in each direction, for v and omega each, and s, the
*spread* of the contact in time, is what the miss of the six coordinates asks for; 0 where noise alone explains it.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.impacts.loose_contact import COORDINATES, spread_without
from estimator.motion.reached import Reached
from estimator.motion.rotation import rotation_from_vector, rotation_vector

Array = NDArray[np.float64]
STEPS = 12
"""Of time and spread in turn, until the time moves by less than a nanosecond."""


class Measured(Protocol):
    """A measured flight."""

    @property
    def ends_s(self) -> tuple[float, float]:
        """First and last time at which it was seen."""

    def at(self, time_s: float) -> Reached:
        """The motion at a time, also beyond those."""

    def change_at(self, time_s: float) -> Array:
        """Rate (6,) of v and omega at a time."""


@dataclass(frozen=True)
class Meeting:
    """An impact between two flights at ``time_s``; ``x`` (3,) m, ``R`` (3, 3), ``before`` and ``after`` (6,) of v and omega, world frame.

    ``covariance`` (18, 18) of position, left rotation vector, before, after; ``gap`` (6,) by which the flights miss one another (m, rad)
    before they are made to agree; ``chi_square`` of 5 of that gap, were the contact of no duration; ``spread_s`` of the contact; ``jump``
    squared Mahalanobis length of after - before.
    """

    time_s: float
    time_sigma_s: float
    x: Array
    R: Array
    before: Array
    after: Array
    covariance: Array
    gap: Array
    chi_square: float
    spread_s: float
    jump: float


@dataclass(frozen=True)
class _Miss:
    """The flights at a time: the gap (6,), its rate (6,) and its Jacobian (6, p), p the parameters of both."""

    before: Reached
    after: Reached
    gap: Array
    rate: Array
    J: Array

    @property
    def contact(self) -> Array:
        """S_c / s² (6, 6)."""
        jump = self.rate
        sizes = np.repeat([jump[:3] @ jump[:3], jump[3:] @ jump[3:]], 3) / 3.0
        return np.diag(sizes)


def _miss(a: Measured, b: Measured, time_s: float) -> _Miss:
    before, after = a.at(time_s), b.at(time_s)
    gap = np.concatenate([after.x - before.x, rotation_vector((after.R @ before.R.T)[None])[0]])
    return _Miss(before, after, gap, after.velocity - before.velocity, np.hstack([-before.pose_J, after.pose_J]))


def meeting(a: Measured, b: Measured, P: Array) -> Meeting:
    """Where ``a``, the earlier flight, ends and ``b`` begins; ``P`` (p, p): joint covariance of the parameters of ``a``, then ``b``."""
    last, first = a.ends_s[1], b.ends_s[0]
    time_s, spread = 0.5 * (last + first), 0.0
    for _ in range(STEPS):
        at = _miss(a, b, time_s)
        spread = _spread(at, P)
        step = _solved(at, P, spread)[0]
        time_s = float(np.clip(time_s + step, last - (first - last), first + (first - last)))
        if abs(step) < 1e-9:
            break
    return _corrected((a, b), _miss(a, b, time_s), P, time_s, spread)


def _solved(at: _Miss, P: Array, spread: float) -> tuple[float, float, Array, Array]:
    """Step of the time and its variance, S⁻¹, and what is left of the gap."""
    weight: Array = np.asarray(np.linalg.inv(at.J @ P @ at.J.T + spread**2 * at.contact), dtype=np.float64)
    variance = 1.0 / float(at.rate @ weight @ at.rate)
    step = -variance * float(at.rate @ weight @ at.gap)
    return step, variance, weight, at.gap + step * at.rate


def _spread(at: _Miss, P: Array) -> float:
    """The spread (s) at which what is left of the gap is as large as expected."""
    return spread_without(lambda spread: _chi_square(at, P, spread) - COORDINATES)


def _chi_square(at: _Miss, P: Array, spread: float) -> float:
    """Of 5, of what is left of the gap."""
    _, _, weight, left = _solved(at, P, spread)
    return float(left @ weight @ left)


def _corrected(flights: tuple[Measured, Measured], at: _Miss, P: Array, time_s: float, spread: float) -> Meeting:
    """Both flights after the update, and the covariance of what is said at the impact."""
    _, variance, weight, left = _solved(at, P, spread)
    gain = P @ at.J.T
    projected = weight - variance * np.outer(weight @ at.rate, weight @ at.rate)
    change = -gain @ weight @ left
    p = len(P)
    C = np.zeros((p + 1, p + 1))
    C[:p, :p] = P - gain @ projected @ gain.T
    C[p, :p] = C[:p, p] = -variance * (gain @ weight @ at.rate)
    C[p, p] = variance
    J = _sensitivity(flights, at, time_s)
    covariance = J @ C @ J.T
    said = J[:, :p] @ change
    before, after = at.before.velocity + said[6:12], at.after.velocity + said[12:]
    D = (J[12:] - J[6:12]) @ C @ (J[12:] - J[6:12]).T
    return Meeting(
        time_s=time_s,
        time_sigma_s=float(np.sqrt(variance)),
        x=at.before.x + said[:3],
        R=rotation_from_vector(said[None, 3:6])[0] @ at.before.R,
        before=before,
        after=after,
        covariance=0.5 * (covariance + covariance.T),
        gap=left,
        chi_square=_chi_square(at, P, 0.0),
        spread_s=spread,
        jump=float((after - before) @ np.linalg.solve(D, after - before)),
    )


def _sensitivity(flights: tuple[Measured, Measured], at: _Miss, time_s: float) -> Array:
    """Position, turn, before and after (18,) by both flights' parameters and the time (p + 1,)."""
    first, p = at.before.pose_J.shape[1], at.J.shape[1]
    J = np.zeros((18, p + 1))
    J[:6, :first], J[6:12, :first], J[12:, first:p] = at.before.pose_J, at.before.velocity_J, at.after.velocity_J
    J[:6, p] = at.before.velocity
    J[6:12, p], J[12:, p] = flights[0].change_at(time_s), flights[1].change_at(time_s)
    return J
