"""What the catalogue lacks, in a field campaign: attraction to a plane, a thrust fixed to the body, in pictures also a drifting focus.

The limit is the size at which what the best effect that flights share leaves of it would be found; it is approached by flying it.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.recipes.effects import KNOWN
from datasets.recipes.synth_only import SYNTH_ONLY
from tumble.challenge.drawing import LARGEST_OUTSIDE, outside_effect
from tumble.challenge.field_case import Effects, FieldCase
from tumble.challenge.field_flights import flown
from tumble.challenge.field_limits import Known, left_at_limit, left_in_pictures, left_of
from tumble.challenge.limits import TABLE, outside_limit, read_table

Array = NDArray[np.float64]
ROUNDS = 3
FIRST_MS2 = 0.3
"""Acceleration that is flown first."""
LARGEST_MS2 = 20.0
FIRST_OVER_LIMIT = 3.0
"""In pictures what is left is seen beside noise: what is flown once must be well above its limit in the older challenge."""
APART_M = (0.1, 0.5)
"""Distance of the wall from the flight that comes nearest to it."""
ARM_M = (1e-3, 5e-3)


def draw_outside(case: FieldCase, of: Known, over: tuple[float, float], rng: np.random.Generator) -> tuple[Effects, dict[str, float]]:
    """A force and its size over its limit.

    Raises
    ------
    InputError
        Where it would have to be larger than nature makes it.
    """
    key, unit, first, largest = _in_pictures(rng) if case.scene is not None else _in_trajectories(case, rng)
    limit = _limit(case, of, key, unit, (first, largest))
    if limit * over[0] >= largest:
        raise InputError(f"{key}: expected a limit below {largest:g}, got more.")
    times = float(np.exp(rng.uniform(*np.log((over[0], min(over[1], largest / limit))))))
    return {key: _of_size(case, key, unit, limit * times)}, {key: times}


def _limit(case: FieldCase, of: Known, key: str, unit: dict[str, float], sizes: tuple[float, float]) -> float:
    """The size whose remains would be found, approached from the first of ``sizes`` and at most the second."""
    left_there, rounds = (left_of, ROUNDS) if case.scene is None else (left_in_pictures, 1)
    size, largest = sizes
    for _ in range(rounds):
        left = left_there(of, replace(case, outside={key: _of_size(case, key, unit, size)}))
        if left <= 0.0:
            raise InputError(f"{key}: expected something left by the catalogue, got nothing.")
        size = min(size * float(np.sqrt(left_at_limit(of) / left)), largest)
    return size


def _in_trajectories(case: FieldCase, rng: np.random.Generator) -> tuple[str, dict[str, float], float, float]:
    """A force of 1 m/s², what is flown first, and the largest."""
    key = "wall_attraction" if case.measured.startswith("positions") else "outgassing_thrust"
    return key, _wall(case, rng) if key == "wall_attraction" else _thrust(rng), FIRST_MS2, LARGEST_MS2


def _in_pictures(rng: np.random.Generator) -> tuple[str, dict[str, float], float, float]:
    """What the older challenge hides, of size one; what is flown first is well above its limit there."""
    key = tuple(SYNTH_ONLY)[int(rng.integers(len(SYNTH_ONLY)))]
    values = outside_effect(key, 1.0, rng).values
    unit = {name: float(np.ravel(value)[0]) for name, value in values.items()}
    return key, unit, min(FIRST_OVER_LIMIT * outside_limit(read_table(TABLE), key), LARGEST_OUTSIDE[key]), LARGEST_OUTSIDE[key]


def _wall(case: FieldCase, rng: np.random.Generator) -> dict[str, float]:
    """A wall of any direction beside all flights; ``strength`` for 1 m/s² where a flight is nearest."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    apart = float(rng.uniform(*APART_M))
    nearest = min(float((flown(case, number).x @ normal).min()) for number in range(len(case.flights)))
    names = KNOWN["wall_attraction"].names
    return dict(zip(names, (apart**2, *(float(n) for n in normal), nearest - apart), strict=True))


def _thrust(rng: np.random.Generator) -> dict[str, float]:
    """A vent; its thrust is 1 m/s²."""
    thrust, arm = rng.normal(size=3), rng.normal(size=3)
    thrust /= np.linalg.norm(thrust)
    arm *= float(rng.uniform(*ARM_M)) / np.linalg.norm(arm)
    return dict(zip(KNOWN["outgassing_thrust"].names, (float(v) for v in (*thrust, *arm)), strict=True))


def _of_size(case: FieldCase, key: str, unit: dict[str, float], size: float) -> dict[str, tuple[float, ...]]:
    """Values of every flight."""
    sizes = KNOWN[key].sizes
    return {name: (value * (size if name in sizes else 1.0),) * len(case.flights) for name, value in unit.items()}
