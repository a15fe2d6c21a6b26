"""Whether measured angular velocities are those of the measured orientations: how far the body turns between rows, told by both.

From row i to row j the orientation turns by ``R_j R_i^T``, world axes, and by ``R_i^T R_j``, body axes. The angular velocity says the same
turn: the product of ``exp(omega dt)`` from row to row, later rows on the left along the world's axes, on the right along the body's. What
is left between the two, over the size of the turns, is their misfit. It is the median of many pairs of rows, so that single wrong rows do
not matter, and neither does that the angular velocity of a free body changes. Where either says more than ``LARGEST_TURN`` from row to row,
the same orientations are those of several spins: then only a mistake is told without which turns are small.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError

Array = NDArray[np.float64]
FEWEST_PAIRS = 6
"""Pairs of rows that are compared; of fewer nothing is said. By judgement."""
MOST_STEPS = 4
"""From the first row of a pair to the second: turns grow with them, noise does not, but a wrong row spoils as many pairs. By judgement."""
LARGEST_TURN = 1.5
"""rad, from row to row and of a pair: half a turn and more is ambiguous, and before that integrals get coarse. By judgement."""
CONTRADICTS, AGREES, BETTER = 0.4, 0.2, 3.0
"""Misfit from which on the two contradict one another, up to which they agree, and by how many times it has to fall. Wrong units have a
misfit of 1, wrong axes mostly of 0.5 to 2; of twelve tracked tosses of a cube at 148 rows per second the right ones have 0.002 to 0.008."""
CONSISTENT = 0.25
"""Share of pairs that may agree where it is said that the two contradict one another without knowing why. By judgement."""
NOISES = 3.0
"""Times of the scatter from row to row by which the two differ before that is said without knowing why. By judgement."""
NO_TURN = 1e6
"""rad, from row to row: what is said to turn further counts as this, since its sine is rounding, or no number."""
DEGREES = 180.0 / np.pi


@dataclass(frozen=True)
class Spin:
    """A measured angular velocity ``omega`` (n, 3) rad/s, along the tracked frame's axes (``of_body``) or the world's, of ``columns``."""

    columns: tuple[str, ...]
    omega: Array
    of_body: bool


@dataclass(frozen=True)
class _Misfit:
    """``share`` of the turns, ``size`` (rad) of what is left of them, ``turn`` from row to row and its ``scatter`` (rad); medians.

    ``best``: the share that is left in those pairs that agree best, at the quantile ``CONSISTENT``.
    ``seen_rads``, ``said_rads``: how fast orientations turn, and the angular velocity.
    """

    share: float
    best: float
    size: float
    turn: float
    scatter: float
    seen_rads: float
    said_rads: float


@dataclass(frozen=True)
class _Mistake:
    """What may be wrong with a spin: what orientations and spin are without it, how that is told, and what to do."""

    q: Array
    spin: Spin
    told: str
    cure: str


def check_turns(path: Path, times_s: Array, q: Array | None, spins: Sequence[Spin]) -> tuple[str, ...]:
    """Notes on angular velocities that contradict the orientations where no known mistake mends it.

    Parameters
    ----------
    path
        The file, for messages.
    times_s
        (n,) s, increasing.
    q
        (n, 4) unit quaternions, scalar last, world from tracked frame, NaN where not measured; ``None``: nowhere.
    spins
        What is to be compared with them.

    Raises
    ------
    InputError
        Where they contradict the orientations and agree in another unit, along the other frame's axes, or with orientations that are read
        another way (inverted, or the scalar first).
    """
    notes = [] if q is None else [_note(path, times_s, q, spin) for spin in spins]
    return tuple(note for note in notes if note)


def _note(path: Path, times_s: Array, q: Array, spin: Spin) -> str:
    """What is to be said of a spin that is known to be wrong, not how; nothing of one that may be right."""
    given = _misfit(times_s, q, spin)
    if given is None or not given.share >= CONTRADICTS:
        return ""
    fits = [(found.share, each) for each in _mistakes(q, spin) if (found := _misfit(times_s, each.q, each.spin)) and _mends(found, given)]
    axes = "tracked frame's" if spin.of_body else "world's"
    where = f"{path}: {', '.join(spin.columns)}: expected the angular velocity, along the {axes} axes, with which qx, qy, qz, qw turn"
    came = f"{given.seen_rads:.3g} rad/s in the median, got {given.said_rads:.3g}, whose turns between rows are off by {given.share:.0%}"
    if fits:
        share, mistake = min(fits, key=lambda fit: fit[0])
        raise InputError(f"{where}, {came}. {mistake.told} they are off by {share:.1%}: {mistake.cure}.")
    if not (given.turn <= LARGEST_TURN and given.best >= CONTRADICTS and given.size > NOISES * given.scatter):
        return ""
    return (
        f"{where}, {came}. No other unit, frame or order that was tried mends it: are axes swapped or turned, or are the two of different "
        "times? They count as measured."
    )


def _mistakes(q: Array, spin: Spin) -> tuple[_Mistake, ...]:
    other, prefix = ("world's", "w") if spin.of_body else ("tracked frame's", "gyro_")
    unit = spin.columns[0].rpartition("_")[2]
    along = ", ".join(f"{prefix}{axis}_{unit}" for axis in "xyz")
    return (
        _Mistake(q, replace(spin, omega=spin.omega / DEGREES), "Taken as degrees per second", _renamed(spin, "degs", "divide")),
        _Mistake(q, replace(spin, omega=spin.omega * DEGREES), "Taken as radians per second", _renamed(spin, "rads", "multiply")),
        _Mistake(
            q,
            replace(spin, of_body=not spin.of_body),
            f"Taken along the {other} axes",
            f"call the columns {along}, or turn the values by the orientation",
        ),
        _Mistake(
            q * [-1.0, -1.0, -1.0, 1.0],
            spin,
            "With the orientations inverted",
            "qx, qy, qz, qw are to turn the tracked frame into the world's; give -qx, -qy, -qz, qw",
        ),
        _Mistake(q[:, [1, 2, 3, 0]], spin, "With the scalar of the quaternions first", "the order is qx, qy, qz, qw, the scalar last"),
    )


def _renamed(spin: Spin, unit: str, otherwise: str) -> str:
    """To name columns by another unit, or, where they have its name already, to change their values."""
    names = [f"{column.rpartition('_')[0]}_{unit}" for column in spin.columns]
    return f"{otherwise} them by {DEGREES:.4g}" if names == list(spin.columns) else f"call the columns {', '.join(names)}"


def _mends(mended: _Misfit, given: _Misfit) -> bool:
    return mended.turn <= LARGEST_TURN and mended.share <= AGREES and BETTER * mended.share <= given.share


def _misfit(times_s: Array, q: Array, spin: Spin) -> _Misfit | None:
    """How far spin and orientations are off one another; ``None`` where there are too few rows."""
    seen = np.isfinite(q).all(axis=1) & np.isfinite(spin.omega).all(axis=1)
    again = np.concatenate([[False], (q[1:] == q[:-1]).all(axis=1)])  # an orientation that is stored again is none of its row
    rows = np.flatnonzero(seen & ~again)
    if len(rows) <= FEWEST_PAIRS:
        return None
    dt, omega, R = np.diff(times_s[rows])[:, None], spin.omega[rows], Rotation.from_quat(q[rows])
    steps = np.clip(np.nan_to_num((0.5 * omega[1:] + 0.5 * omega[:-1]) * dt), -NO_TURN, NO_TURN)
    turns = _turns(R, 1, of_body=spin.of_body).as_rotvec()
    turn = max(_median(each) for each in (turns, steps))
    count = int(np.clip(LARGEST_TURN // max(turn, 1e-300), 1, min(MOST_STEPS, len(rows) - FEWEST_PAIRS)))
    found, said = _turns(R, count, of_body=spin.of_body), _integral(steps, count, of_body=spin.of_body)
    best, size = np.quantile((found * said.inv()).magnitude(), (CONSISTENT, 0.5)).tolist()
    of = float(np.median(np.maximum(found.magnitude(), said.magnitude())))
    scatter = _median(np.diff(turns, axis=0)) + count * _median(np.diff(steps, axis=0))
    of = of or np.inf
    return _Misfit(size / of, best / of, size, turn, scatter, _median(turns / dt), _median(omega))


def _median(vectors: Array) -> float:
    """The median length of vectors (n, 3)."""
    return float(np.median(np.linalg.norm(vectors, axis=1)))


def _turns(R: Rotation, count: int, *, of_body: bool) -> Rotation:
    """The turns over ``count`` rows."""
    return R[:-count].inv() * R[count:] if of_body else R[count:] * R[:-count].inv()


def _integral(steps: Array, count: int, *, of_body: bool) -> Rotation:
    """Turns over ``count`` rows of those from row to row ``steps`` (n, 3) rad, rotation vectors along the axes they are taken about."""
    each = Rotation.from_rotvec(steps)
    pairs = len(steps) - count + 1
    whole = each[:pairs]
    for k in range(1, count):
        later = each[k : k + pairs]
        whole = whole * later if of_body else later * whole
    return whole
