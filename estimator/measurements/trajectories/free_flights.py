"""Which rows of a trajectory are free flight: found by what gravity does to the path, with nothing known of what is touched.

Rows are split into flights and rows in contact so that the sum of their costs is least, over all splits (dynamic programming). A flight
costs the squared residuals of a parabola over their variance, its acceleration held near gravity, and ``FLIGHT_COST``; a row that is in no
flight costs ``ROW_COST``. So a sharp impact ends one flight and begins the next between two rows, one that lasts leaves rows out, and what
lies, rolls or slides does not fall with gravity and is in no flight. The segmentation looks at positions alone: what strikes is stopped as
well as turned.

Noise of the path is taken from rows that move, since trackers at rest repeat themselves, and from the quieter of their neighbourhoods,
since those with impacts are not noise. A flight needs so many rows that gravity bends its path by far more than noise; one in contact
for as long as ``MOST_CONTACT`` rows is no impact any more but rolling or resting.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.polynomial import polyvander
from numpy.typing import NDArray
from scipy.special import chdtri

from estimator.effects.catalogue.dynamics.uniform_acceleration import UniformAcceleration

Array = NDArray[np.float64]
LEAST_ROWS = 5
"""Of a flight: a parabola in three coordinates takes up three of them."""
MOST_CONTACT = 3
"""Rows between two flights that one impact may last."""
FLIGHT_COST, ROW_COST = 30.0, 60.0
"""Costs, in units of chi-squared, of a flight and of a row that is in none (above). By judgement."""
TAILS = 2.0
"""Standard deviations count as so many times as large: trackers' noise has tails and is alike in neighbouring rows."""
ACCELERATION_SIGMA_MS2 = 0.5
"""How far accelerations of flights may be from gravity: air, a scale or a clock that is 2% wrong."""
MOST_MEAN_SQUARE, MOST_OFF_MS2 = 2.0, 1.5
"""What a parabola may leave, over its expected variance, and how far its acceleration may be off gravity (m/s²) beside its uncertainty.

By judgement."""
LEAST_SAG = 8.0
"""Of what gravity bends the path by, over the noise."""
SETS_IN_MS2 = float(np.linalg.norm([p.plausible[1] for p in UniformAcceleration().entry.parameters]))
"""Force per mass that may set in between two rows of a free flight (m/s²): the largest that the catalogue has."""
BEFORE, SIGNIFICANT = 10, 3.0
"""Rows that are carried on beyond a contact, and standard deviations by which what follows has to depart from that. By judgement."""
WINDOW, CUBIC, MOVING, QUIET = 7, 4, 0.2, 0.3
"""Rows that noise is taken of, coefficients of a cubic, share of the largest speed that moves, quantile of quiet windows. By judgement."""


@dataclass(frozen=True)
class Run:
    """A free flight in rows ``first`` to ``last``, the latter not among them."""

    first: int
    last: int


def path_noise(paths: list[tuple[Array, Array]]) -> float:
    """Standard deviation (m) of a coordinate, of several ``paths``, each times (n,) s and positions (n, c) m; 0 where nothing moves."""
    usual = [float(chdtri(x.shape[1] * (WINDOW - CUBIC), 1.0 - QUIET)) for _, x in paths]
    squares = np.concatenate([np.zeros(0), *(_window_squares(times, x) / u for (times, x), u in zip(paths, usual, strict=True))])
    return float(np.sqrt(np.quantile(squares, QUIET))) if len(squares) else 0.0


def _window_squares(times_s: Array, x: Array) -> Array:
    """Squared residuals of a cubic in every window of rows that moves."""
    if len(x) < WINDOW:
        return np.zeros(0)
    starts = np.arange(len(x) - WINDOW + 1)
    rows = starts[:, None] + np.arange(WINDOW)
    t = times_s[rows] - times_s[rows].mean(axis=1, keepdims=True)
    t = t / np.abs(t).max(axis=1, keepdims=True)
    Q = np.linalg.qr(t[:, :, None] ** np.arange(CUBIC))[0]
    left = x[rows] - Q @ (np.swapaxes(Q, 1, 2) @ x[rows])
    speed = np.linalg.norm(x[rows[:, -1]] - x[rows[:, 0]], axis=1) / (times_s[rows[:, -1]] - times_s[rows[:, 0]])
    return np.asarray(np.sum(left**2, axis=(1, 2))[speed > MOVING * speed.max()])


def free_flights(times_s: Array, x: Array, gravity: Array, sigma: float) -> tuple[Run, ...]:
    """The flights of a path: ``times_s`` (n,), world frame ``x`` (n, 3) m and ``gravity`` (3,) m/s², noise ``sigma`` (m)."""
    noise = TAILS * sigma
    least = least_rows(times_s, float(np.linalg.norm(gravity)), noise)
    fallen = x - 0.5 * gravity * (times_s - times_s[0])[:, None] ** 2
    n = len(x)
    best, chosen = np.full(n + 1, np.inf), np.full(n + 1, -1, dtype=np.int64)
    best[0] = 0.0
    for first in range(n):
        if best[first] + ROW_COST < best[first + 1]:
            best[first + 1], chosen[first + 1] = best[first] + ROW_COST, -1
        if n - first < least:
            continue
        ends = np.arange(first + least, n + 1)
        total = best[first] + FLIGHT_COST + flight_costs(times_s[first:], fallen[first:], noise, least)
        better = total < best[ends]
        best[ends[better]], chosen[ends[better]] = total[better], first
    runs, last = [], n
    while last > 0:
        if chosen[last] >= 0:
            runs.append(Run(int(chosen[last]), last))
        last = int(chosen[last]) if chosen[last] >= 0 else last - 1
    return tuple(run for run in reversed(runs) if flies(times_s[run.first : run.last], fallen[run.first : run.last], noise))


def free_rows(times_s: Array, x: Array, gravity: Array, sigma: float) -> tuple[int, int]:
    """From which row on a path is free, let go of or thrown, and the one before which it is until it touches something.

    ``times_s`` (n,), world frame ``x`` (n, c) m and ``gravity`` (c,) m/s² along the c axes that were measured, noise ``sigma`` (m). What
    lies still is left out first; of what falls, a film that runs backwards shows a hand that lets go with a jump of the velocity as a
    contact. A hand that speeds up smoothly makes none.
    """
    first = rows_at_rest(times_s, x, gravity, sigma)
    let_go, last = (first + row for row in until_contact(times_s[first:], x[first:], gravity, sigma))
    caught, kept = until_contact(-times_s[let_go:last][::-1], x[let_go:last][::-1], gravity, sigma)
    return last - kept, last - caught


def rows_at_rest(times_s: Array, x: Array, gravity: Array, sigma: float) -> int:
    """How many rows lie still at the beginning of a path, long enough to show that they do not fall, as still as they show by themselves.

    What moves at a constant velocity or falls is never further from the mean of where it was than 2.3 times its standard deviation there.

    ``times_s`` (n,), world frame ``x`` (n, c) m and ``gravity`` (c,) m/s² along the c axes that were measured, noise ``sigma`` (m).
    """
    if len(x) <= LEAST_ROWS:
        return 0
    count, away = np.arange(1, len(x))[:, None], x - x[0]
    mean = np.cumsum(away, axis=0)[:-1] / count
    spread = np.sqrt(np.maximum(np.cumsum(away**2, axis=0)[:-1] / count - mean**2, 0.0).sum(axis=1))
    off = np.linalg.norm(away[1:] - mean, axis=1) > SIGNIFICANT * np.maximum(TAILS * sigma * x.shape[1] ** 0.5, spread)
    leaves = np.flatnonzero(off[LEAST_ROWS - 1 : -1] & off[LEAST_ROWS:])
    still = int(leaves[0]) + LEAST_ROWS if len(leaves) else 0
    bent = 0.5 * float(np.linalg.norm(gravity)) * (times_s[still - 1] - times_s[0]) ** 2 if still else 0.0
    return still if bent > 2.0 * LEAST_SAG * max(TAILS * sigma, float(spread[still - 1])) else 0


def until_contact(times_s: Array, x: Array, gravity: Array, sigma: float) -> tuple[int, int]:
    """From where on a path falls, after what held it and let go with a jump, and the row before which it does until the first contact.

    ``times_s`` (n,), world frame ``x`` (n, c) m and ``gravity`` (c,) m/s² along the c axes that were measured, noise ``sigma`` (m). A
    contact is a jump of the velocity of what falls: the rows after it have left the parabola that those before go on with, and their
    velocities differ from its, all of them, by more than noise, than a force that sets in (``SETS_IN_MS2``), and than the force that acts
    already, reversed, could make. A gap in the clock moves rows along the path, and leaves velocities alone; so that no single bad row
    makes one, each row before it is left out in turn. Nor does one hide it: those that are far off the others count in no parabola, and
    the last one before may be bad. What comes back to the parabola touched nothing.
    What is held, and let go, lies still before rather than falls: the path is looked at from there on. Seen are contacts after a flight
    of ``LEAST_ROWS`` rows and ``MOST_CONTACT`` more, with two rows after them, whose jump is above noise within three rows.
    """
    fallen = x - 0.5 * gravity * (times_s - times_s[:1])[:, None] ** 2
    first, row = 0, LEAST_ROWS + MOST_CONTACT - 1
    while (row := row + 1) < len(x) - 1:
        before, after = np.arange(max(first, row - BEFORE), row), np.arange(row, min(row + MOST_CONTACT, len(x)))
        left = any(_left_by_all(times_s, fallen, rows, after, TAILS * sigma) for rows in (before, before[:-1]))
        if left and not _comes_back(times_s, fallen, before, TAILS * sigma):
            flown = _not_bad(times_s, fallen, np.arange(first, row), TAILS * sigma)
            share = share_of_gravity(times_s[flown], x[flown], gravity)
            if share is None or abs(1.0 - share) < abs(share):
                return first, _free(times_s, fallen, (first, row), TAILS * sigma)
            first, row = row, row + LEAST_ROWS + MOST_CONTACT - 1
    return first, len(x)


@dataclass(frozen=True)
class _Path:
    """A parabola through some rows: ``terms`` (3, 3) m in powers of time over ``span_s`` (s) from ``last_s``, and its uncertainty."""

    terms: Array
    inverse: Array
    noise: float
    last_s: float
    span_s: float

    @classmethod
    def through(cls, times_s: Array, fallen: Array, noise: float) -> "_Path":
        """The parabola through rows at ``times_s`` (n,) with places ``fallen`` (n, 3) m; noise (m) is at least what it leaves of them."""
        span = float(np.ptp(times_s))
        powers = polyvander((times_s - times_s[-1]) / span, 2)
        inverse = np.linalg.inv(powers.T @ powers)
        terms = inverse @ powers.T @ fallen
        left = np.sum((fallen - powers @ terms) ** 2) / (fallen.shape[1] * (len(times_s) - powers.shape[1]))
        return cls(terms, inverse, max(noise, float(np.sqrt(left))), float(times_s[-1]), span)

    def beyond(self, times_s: Array, fallen: Array) -> tuple[Array, Array]:
        """How far rows (n,), at ``times_s`` (n,) and ``fallen`` (n, 3) m, are off the parabola (m), and the standard deviation of that."""
        powers = np.asarray(polyvander((times_s - self.last_s) / self.span_s, 2), dtype=np.float64)
        return self._compared(powers, fallen, np.ones(len(times_s)))

    def faster(self, times_s: Array, fallen: Array) -> tuple[Array, Array]:
        """The same of the velocities (m/s) between rows: (n - 1,) each."""
        middle, interval = 0.5 * (times_s[1:] + times_s[:-1]), np.diff(times_s)
        u = (middle - self.last_s) / self.span_s
        slopes = np.column_stack([np.zeros_like(u), np.ones_like(u), 2.0 * u]) / self.span_s
        return self._compared(slopes, np.diff(fallen, axis=0) / interval[:, None], 2.0 / interval**2)

    @property
    def force(self) -> float:
        """What acts beside gravity, over the mass (m/s²)."""
        return float(2.0 * np.linalg.norm(self.terms[2])) / self.span_s**2

    def _compared(self, rows: Array, measured: Array, own: Array) -> tuple[Array, Array]:
        off = np.linalg.norm(measured - rows @ self.terms, axis=1)
        return off, self.noise * np.sqrt(own + np.einsum("ij,jk,ik->i", rows, self.inverse, rows))


def _left_by_all(times_s: Array, fallen: Array, before: NDArray[np.intp], after: NDArray[np.intp], noise: float) -> bool:
    """Whether rows ``after`` jump off the parabola through those ``before`` them that are not bad, whichever one of them is left out."""
    before = _not_bad(times_s, fallen, before, noise)
    kept = [before, *(np.delete(before, i) for i in range(len(before)))]
    return all(_jumps(times_s, fallen, rows, after, noise) for rows in kept)


def _comes_back(times_s: Array, fallen: Array, before: NDArray[np.intp], noise: float) -> bool:
    """Whether two rows that follow one another, of the next few, are on the parabola through those ``before`` them that are not bad."""
    rows = _not_bad(times_s, fallen, before, noise)
    next_few = slice(before[-1] + 2, before[-1] + 2 + 2 * MOST_CONTACT)
    off, sure = _Path.through(times_s[rows], fallen[rows], noise).beyond(times_s[next_few], fallen[next_few])
    on = off <= SIGNIFICANT * sure
    return bool(np.any(on[1:] & on[:-1]))


def _not_bad(times_s: Array, fallen: Array, rows: NDArray[np.intp], noise: float) -> NDArray[np.intp]:
    """Rows less those far off the parabola through all others [Cook and Weisberg 1982], the furthest one first; not if that is the last."""
    while len(rows) > LEAST_ROWS:
        powers = polyvander((times_s[rows] - times_s[rows[-1]]) / np.ptp(times_s[rows]), 2)
        Q = np.linalg.qr(powers)[0]
        left, freedom = fallen[rows] - Q @ (Q.T @ fallen[rows]), fallen.shape[1] * (len(rows) - 1 - powers.shape[1])
        others = np.maximum(1.0 - np.sum(Q**2, axis=1), np.finfo(np.float64).eps)
        square = np.sum(left**2, axis=1) / others
        variance = np.maximum(noise**2, np.maximum(np.sum(left**2) - square, 0.0) / freedom)
        far = square / variance
        worst = int(np.argmax(far))
        if far[worst] <= SIGNIFICANT**2 or worst == len(rows) - 1:
            break
        rows = np.delete(rows, worst)
    return rows


def _jumps(times_s: Array, fallen: Array, before: NDArray[np.intp], after: NDArray[np.intp], noise: float) -> bool:
    """Whether rows ``after`` go on with another velocity than a parabola through those ``before`` them."""
    path = _Path.through(times_s[before], fallen[before], noise)
    later, force = times_s[after] - times_s[before[-1]], SETS_IN_MS2 + 2.0 * path.force
    off, sure = path.beyond(times_s[after], fallen[after])
    if not (off > 0.5 * force * later**2 + SIGNIFICANT * sure).all():
        return False
    faster, sure = path.faster(times_s[after], fallen[after])
    return bool((faster > force * later[1:] + SIGNIFICANT * sure).all())


def _free(times_s: Array, fallen: Array, between: tuple[int, int], noise: float) -> int:
    """Before which row a path is free ``between`` a row and a jump: those of a contact that lasts have left it, the last one may have."""
    first, row = between
    before = np.arange(max(first, row - BEFORE), row - MOST_CONTACT)
    near = np.arange(row - MOST_CONTACT, row)
    off, sure = _Path.through(times_s[before], fallen[before], noise).beyond(times_s[near], fallen[near])
    return int(next(iter(near[off > SIGNIFICANT * sure]), row - 1))


def share_of_gravity(times_s: Array, x: Array, gravity: Array) -> float | None:
    """Acceleration of a parabola along gravity, over it; ``None`` without gravity or where too few rows have positions.

    ``times_s`` (n,), ``x`` (n, c) m, world frame, NaN where not measured; ``gravity`` (c,) m/s², world frame.
    """
    x, gravity = x[:, gravity != 0.0], gravity[gravity != 0.0]
    seen, size = np.isfinite(x).all(axis=1), float(np.linalg.norm(gravity))
    if size == 0.0 or seen.sum() < LEAST_ROWS:
        return None
    fitted = np.polynomial.polynomial.polyfit(times_s[seen] - times_s[seen].mean(), x[seen] @ gravity / size, 2)
    return float(2.0 * fitted[2] / size)


def least_rows(times_s: Array, gravity: float, noise: float) -> int:
    """How many rows a flight needs; ``times_s`` (n,)."""
    interval = float(np.median(np.diff(times_s)))
    longest = np.sqrt(8.0 * LEAST_SAG * noise / gravity) if gravity > 0.0 else 0.0
    return max(LEAST_ROWS, int(np.ceil(longest / interval)) + 1)


def _parabolas(times_s: Array, fallen: Array) -> tuple[Array, Array, Array]:
    """Normal matrices (n, 3, 3), right-hand sides (n, 3, 3) and squares (n,) of parabolas through the first 1, 2 … n rows."""
    t = times_s - times_s[0]
    y = fallen - fallen[0]
    A = np.column_stack([np.ones_like(t), t, 0.5 * t**2])
    return (
        np.cumsum(A[:, :, None] * A[:, None, :], axis=0),
        np.cumsum(A[:, :, None] * y[:, None, :], axis=0),
        np.cumsum(np.sum(y**2, axis=1)),
    )


def flight_costs(times_s: Array, fallen: Array, noise: float, least: int) -> Array:
    """Squared residuals over their variance of flights through the first ``least``, ``least`` + 1 … n rows.

    ``fallen`` (n, 3) m, world frame, is the path without what gravity adds.
    ``times_s`` (n,).
    """
    normal, right, square = (sums[least - 1 :] for sums in _parabolas(times_s, fallen))
    held = normal + np.diag([0.0, 0.0, (noise / ACCELERATION_SIGMA_MS2) ** 2])
    scale = np.sqrt(np.einsum("nii->ni", held))
    solved = np.linalg.solve(held / scale[:, :, None] / scale[:, None, :], right / scale[:, :, None]) / scale[:, :, None]
    return np.asarray(np.maximum(square - np.sum(right * solved, axis=(1, 2)), 0.0) / noise**2)


def flies(times_s: Array, fallen: Array, noise: float) -> bool:
    """Whether rows are those of a free flight: a parabola fits, and falls with gravity.

    ``times_s`` (n,), ``fallen`` (n, 3) m, world frame: the path without what gravity adds.
    """
    n = len(times_s)
    if flight_costs(times_s, fallen, noise, n)[-1] > MOST_MEAN_SQUARE * (3 * n - 6):
        return False
    normal, right, _ = _parabolas(times_s, fallen)
    scale = np.sqrt(np.diag(normal[-1]))
    inverse = np.linalg.inv(normal[-1] / np.outer(scale, scale)) / np.outer(scale, scale)
    off, sigma = (inverse @ right[-1])[2], noise * float(np.sqrt(inverse[2, 2]))
    return bool(np.linalg.norm(off) <= MOST_OFF_MS2 + SIGNIFICANT * sigma)
