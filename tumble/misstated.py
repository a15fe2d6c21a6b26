"""Whether positions accelerate as no flight under the stated gravity does: then gravity, lengths or times are stated wrongly.

Of every flight a cubic in time gives the acceleration a, and how fast that changes, j. What acts beside the stated gravity, a - g, is
judged by what the catalogue's dynamics could do within their plausible ranges:

- An acceleration that is constant (``uniform_acceleration``) reaches ``FORCE_MS2`` along an axis.
- Air (drag, lift, wind) acts by the velocity relative to it: a - g = M (v - w), so that a changes by M times the change of v. How far that
  is seen bounds M: in a flight, where j = M a, and between flights of other velocities, whose accelerations scatter by M times as much as
  their velocities. Air then reaches |M| (|v| + ``WIND_MS``). Noise makes the bound wider. So a ball whose lift makes it fall with 0.6 of
  gravity is not judged, since its acceleration changes with v; a toss of which the sign of gravity is stated wrongly is. Flights are not
  compared where a may be zero: what sinks steadily or floats in a wind has the velocity that makes it so.

Nothing is judged where most flights are within that, where they disagree about a, or where a plug-in of the user's may act: a force outside
of the catalogue may be as strong. Lengths that are k times too large, or times that are k^-0.5 times too long, make k times the gravity.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyvander
from numpy.typing import NDArray

from datasets.toml_text import read_toml
from datasets.trajectory import Trajectory
from datasets.trajectory_surroundings import FOLDER_FILE
from datasets.vocabulary.effects import EFFECTS
from estimator.geometry.robust_scale import robust_sigma
from tumble.numbers import compact

Array = NDArray[np.float64]
FORCE_MS2 = max(high for p in EFFECTS["uniform_acceleration"].parameters for high in p.plausible)
"""Largest constant acceleration along an axis that the catalogue expects (m/s²)."""
WIND_MS = float(np.linalg.norm([p.plausible[1] for p in EFFECTS["steady_wind"].parameters]))
"""Strongest steady wind that the catalogue expects (m/s)."""
SCALE_OFF = EFFECTS["length_scale"].parameters[0].plausible[1]
"""Relative error of lengths that the catalogue expects: as near a unit's factor is to be, for it to be named."""
CLEAR = 3.0
"""Standard deviations from which an acceleration counts as beyond a bound."""
LEAST_ROWS = 7
"""Rows of a flight that is judged: a cubic and as many to see the noise by."""
UNITS = {1000.0: "millimetres", 100.0: "centimetres", 1.0 / 0.0254: "inches", 1.0 / 0.3048: "feet"}
"""How many of them make a metre."""
AXES, MEND = "xyz", "mend"


@dataclass(frozen=True)
class Misstated:
    """What is stated wrongly: a ``sentence``, and where to ``mend`` it."""

    sentence: str
    mend: str


@dataclass(frozen=True)
class Flight:
    """Middle of a flight, world frame, NaN along axes that were not measured.

    ``v`` (3,) m/s, acceleration ``a`` (3,) m/s² and how fast that changes, ``jerk`` (3,) m/s³, with ``sigma_a`` (3,) m/s² and
    ``sigma_jerk`` (3,) m/s³; stated ``gravity`` (3,) m/s²; ``fastest`` speed in it, m/s.
    """

    v: Array
    a: Array
    jerk: Array
    sigma_a: Array
    sigma_jerk: Array
    gravity: Array
    fastest: float

    def beyond(self, between: float) -> bool:
        """Whether neither a constant acceleration nor air makes the excess; ``between``: how accelerations of flights go by v, 1/s."""
        excess, size = self.a - self.gravity, _length(self.a)
        if not _too_strong(excess, self.sigma_a) or size == 0.0:
            return False
        rate, least = _length(self.jerk) / size, (_length(self.jerk) - CLEAR * _length(self.sigma_jerk)) / size
        if size > CLEAR * _length(self.sigma_a):
            rate = min(rate, max(between, least))
        return _length(excess) - CLEAR * _length(self.sigma_a) > rate * (self.fastest + WIND_MS)


def flight_of(t: Trajectory) -> Flight | None:
    """The flight of a trajectory; ``None`` without gravity, or where too few rows have positions."""
    gravity, measured = t.surroundings.gravity_world, np.isfinite(t.x_world).any(axis=0)
    rows = np.isfinite(t.x_world[:, measured]).all(axis=1)
    if not gravity.any() or not measured.any() or rows.sum() < LEAST_ROWS:
        return None
    times, x = t.times_s[rows], np.where(measured, t.x_world[rows], np.nan)
    half = 0.5 * float(np.ptp(times))
    powers = polyvander((times - times[0]) / half - 1.0, 3)
    inverse = np.linalg.inv(powers.T @ powers)
    terms = inverse @ powers.T @ x
    noise = np.sqrt(np.sum((x - powers @ terms) ** 2, axis=0) / (len(x) - len(terms)))
    derivatives = np.array([1.0, 1.0 / half, 2.0 / half**2, 6.0 / half**3])[:, None]
    _, v, a, jerk = derivatives * terms
    _, _, sigma_a, sigma_jerk = derivatives * np.sqrt(np.diag(inverse))[:, None] * noise
    return Flight(v, a, jerk, sigma_a, sigma_jerk, np.where(measured, gravity, np.nan), _length(v) + half * _length(a))


def _between(flights: Sequence[Flight]) -> float:
    """Scatter of the accelerations of flights over that of their velocities (1/s)."""
    v, a = np.array([f.v for f in flights]), np.array([f.a for f in flights])
    of_v, of_a = (_length(robust_sigma(each - np.median(each, axis=0))) for each in (v, a))
    return of_a / of_v if of_v > 0.0 else math.inf


def misstated(trajectories: Mapping[str, Trajectory], source: Path, typed: Mapping[str, Any]) -> Misstated | None:
    """What is stated wrongly of ``trajectories`` from ``source``, if anything; ``typed``: surroundings from the command line."""
    judged = [flight for t in trajectories.values() if (flight := flight_of(t)) is not None]
    between = _between(judged) if judged else math.inf
    flights = [flight for flight in judged if flight.beyond(between)]
    if 2 * len(flights) <= len(judged):
        return None
    a, gravity = np.median([f.a for f in flights], axis=0), np.median([f.gravity for f in flights], axis=0)
    sigma = np.hypot(np.median([f.sigma_a for f in flights], axis=0), robust_sigma(np.array([f.a for f in flights]) - a))
    if not _too_strong(a - gravity, sigma):
        return None
    a, sigma, gravity = (np.where(np.isfinite(each), each, 0.0) for each in (a, sigma, gravity))
    sentence, units = _sentence(a, sigma, gravity, f"median of {len(flights)} sequence{'s' * (len(flights) > 1)}")
    columns = f"the columns of positions (x_m, x_mm) and times (t_s, t_ms) of {source}, or " if units else ""
    where = _stated_in(source, trajectories, typed)
    return Misstated(sentence, f"{MEND} {columns}gravity_world in {where}, then run the same command again with --force")


def to_mend(verdict: Mapping[str, Any]) -> bool:
    """Whether the verdict of a ``diagnosis.json`` is that something is stated wrongly: then nothing else of it is worth telling."""
    return str(verdict["next"]).startswith(f"{MEND} ")


def _sentence(a: Array, sigma: Array, gravity: Array, counted: str) -> tuple[str, bool]:
    """What is wrong where positions accelerate by ``a`` (3,) m/s² and ``gravity`` was stated, and whether units are rather than gravity."""
    size = _length(gravity)
    if size == 0.0:
        return f"Positions accelerate {_along(a, sigma)} ({counted}), {NOT_ALONG} Check first what was stated: gravity_world.", False
    down = gravity / size
    share, off = float(a @ down), float(np.sqrt(down**2 @ sigma**2))
    fall, across = f"{compact(share / size, off / size)} times the stated gravity", a - share * down
    also = f"; and units: {_scale_words(_length(a) / size)}" if abs(_length(a) - size) > FORCE_MS2 else ""
    if _length(across) > abs(share):
        told = f"Positions fall with {fall} and accelerate {_along(across, sigma)}, across it ({counted}), {NO_EFFECT}"
        return f"{told} the axis of gravity_world{also}.", False
    told = f"Positions fall with {fall} (along it, {counted}), {NO_EFFECT}"
    if share < 0.0:
        return f"{told} the sign of gravity_world, or that of the vertical axis{also}.", False
    return f"{told} units: {_scale_words(share / size)}.", True


NO_EFFECT = "as no effect of the catalogue makes them. Check first what was stated:"
NOT_ALONG = "and gravity is stated along an axis that was not measured."


def _along(a: Array, sigma: Array) -> str:
    """The axis that an acceleration is mostly along, and how large it is there."""
    axis = int(np.argmax(np.abs(a)))
    return f"along {'-' if a[axis] < 0.0 else '+'}{AXES[axis]} by {compact(abs(float(a[axis])), float(sigma[axis]))} m/s2"


def _stated_in(source: Path, names: Iterable[str], typed: Mapping[str, Any]) -> str:
    """Where gravity is stated."""
    if "gravity_world" in typed:
        return "the command line (--gravity)"
    folder = source if source.is_dir() else source.parent
    own = next((file for name in names if (file := folder / f"{name}.toml").is_file()), None)
    return str(own if own is not None and "gravity_world" in read_toml(own) else folder / FOLDER_FILE)


def _scale_words(k: float) -> str:
    """What makes ``k`` times the acceleration, from units of lengths and times."""
    many, times = k > 1.0, max(k, 1.0 / k)
    near = [name for factor, name in UNITS.items() if abs(times / factor - 1.0) <= SCALE_OFF]
    units = (f" ({near[0]} called metres)" if many else f" (metres called {near[0]})") if near else ""
    frames = "" if many or near else " (frames called seconds?)"
    return (
        f"lengths that are {times:.3g} times too {'large' if many else 'small'}{units}, or times that are {times**0.5:.3g} times too "
        f"{'short' if many else 'long'}{frames}, do that"
    )


def _too_strong(excess: Array, sigma: Array) -> bool:
    """Whether an acceleration ``excess`` (3,) m/s² with ``sigma`` (3,) is above any constant one of the catalogue along an axis."""
    return bool(np.any(np.abs(excess) - CLEAR * sigma > FORCE_MS2))


def _length(vector: Array) -> float:
    """Length over the axes that were measured."""
    return float(np.sqrt(np.nansum(vector**2)))
